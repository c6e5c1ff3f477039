// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/commands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <optional>

#include "gateway/base/since.h"
#include "gateway/base/spelling.h"
#include "gateway/cli/client/in_use.h"
#include "gateway/cli/client/points.h"
#include "gateway/cli/client/release.h"
#include "gateway/cli/client/status.h"
#include "gateway/cli/client/trace.h"
#include "gateway/cli/client/writes.h"
#include "gateway/cli/live/demo.h"
#include "gateway/cli/live/run.h"
#include "gateway/cli/offline/certs.h"
#include "gateway/cli/offline/check.h"
#include "gateway/cli/offline/decode.h"
#include "gateway/cli/offline/map.h"
#include "gateway/cli/offline/profiles.h"
#include "gateway/cli/offline/protocols.h"
#include "gateway/cli/offline/simulate.h"
#include "gateway/cli/settings/settings.h"
#include "gateway/cli/terminal/output.h"
#include "gateway/cli/terminal/words.h"
#include "gateway/simulate/fault_text.h"
#ifdef BAUDGATE_WITH_DDS
#include "gateway/cli/live/discovery_server.h"
#include "gateway/cli/live/watch.h"
#endif

namespace baudgate {
namespace {

constexpr int kCannotOpen = 4;

/// Reads "250ms" into a Duration.
CLI::Option* AddDuration(CLI::App& app, const std::string& name, Duration& target,
                         const std::string& help) {
  return app.add_option_function<std::string>(
      name,
      [&target](const std::string& text) {
        const auto duration = ParseDuration(text);
        if (!duration) throw CLI::ValidationError(duration.error());
        target = *duration;
      },
      help);
}

void AddRun(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("run", "Run the gateway in the foreground");
  auto file = std::make_shared<std::string>();
  command->add_option("-c,--config", *file, "Configuration file")->required();
  command->callback([file, &action] {
    action = [file](const auto& catalog) { return RunDaemon(*file, catalog, std::cerr); };
  });
}

void AddCheck(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("check", "Check a configuration and list every error");
  auto file = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  command->add_option("-c,--config", *file, "Configuration file")->required();
  command->add_flag("--json", *json, "Print one JSON object");
  command->callback([file, json, &action] {
    action = [=](const auto& catalog) {
      return RunCheck(*file, catalog, std::cout, std::cerr, *json);
    };
  });
}

void AddCerts(CLI::App& app, Action& action) {
  auto* certs = app.add_subcommand("certs", "Make certificates");
  certs->require_subcommand(1);
  auto* command = certs->add_subcommand("dds", "An authority and identities for DDS Security");
  auto options = std::make_shared<CertsOptions>();
  command->add_option("DIR", options->directory, "Folder, made where it is missing")->required();
  command->add_option("--gateway", options->gateways, "Name of a gateway; may be repeated")
      ->take_all();
  command->add_option("--subscribers", options->subscribers, "How many subscribers")
      ->check(CLI::Range(0, 100));
  command->callback([options, &action] {
    action = [options](const auto&) { return RunCerts(*options, std::cout, std::cerr); };
  });
}

void AddMap(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("map", "Print the register and topic table, point by point");
  auto file = std::make_shared<std::string>();
  auto format = std::make_shared<MapFormat>(MapFormat::table);
  command->add_option("-c,--config", *file, "Configuration file")->required();
  auto* csv = command->add_flag_callback("--csv", [format] { *format = MapFormat::csv; });
  command->add_flag_callback("--json", [format] { *format = MapFormat::json; })->excludes(csv);
  command->callback([file, format, &action] {
    action = [=](const auto& catalog) {
      return RunMap(*file, catalog, *format, std::cout, std::cerr);
    };
  });
}

void AddWatch([[maybe_unused]] CLI::App& app, [[maybe_unused]] Action& action) {
#ifdef BAUDGATE_WITH_DDS
  // Its words are those of baudgate-dds, which reads them.
  auto* command = app.add_subcommand("watch", "Show what gateways publish on DDS");
  command->set_help_flag();
  command->prefix_command();
  command->callback([command, &action] {
    action = [words = command->remaining()](const auto&) { return RunWatch(words, std::cerr); };
  });
#endif
}

void AddDiscoveryServer([[maybe_unused]] CLI::App& app, [[maybe_unused]] Action& action) {
#ifdef BAUDGATE_WITH_DDS
  auto* command = app.add_subcommand("discovery-server",
                                     "Introduce gateways and DDS subscribers to each other");
  auto listen = std::make_shared<std::string>("127.0.0.1:11811");
  command->add_option("--listen", *listen, "ADDRESS:PORT of this machine; 0.0.0.0 for all")
      ->capture_default_str();
  command->callback([listen, &action] {
    action = [listen](const auto&) { return RunDiscoveryServer(*listen, std::cerr); };
  });
#endif
}

void AddSimulate(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("simulate", "Run a device twin on a pty");
  auto options = std::make_shared<SimulateOptions>();
  command->add_option("--profile", options->profile, "Device profile")->required();
  command->add_option("--protocol", options->protocol,
                      "Protocol, where it is not the one whose profile it is");
  command->add_option("--address", options->address, "Address on the line")->required();
  command->add_option("--pty", options->pty, "Path at which the pty is linked")->required();
  command->add_option("--baud", options->serial, "Keep this bit rate, for example \"9600 7E1\"");
  AddDuration(*command, "--think", options->think_time, "Time before each reply, 5ms if not given");
  command->add_option("--set", options->set, "Device option, key=value")->take_all();
  command
      ->add_option_function<std::vector<std::string>>(
          "--fault",
          [options](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              auto fault = ParseFault(text);
              if (!fault) throw CLI::ValidationError("--fault", fault.error());
              options->faults.push_back(std::move(*fault));
            }
          },
          "Misbehave: KIND[:key=value,...], for example loss:rate=0.1; may be repeated")
      ->take_all();
  command->callback([options, &action] {
    action = [=](const auto& catalog) {
      return RunSimulate(*options, catalog, std::cout, std::cerr);
    };
  });
}

void AddDecode(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("decode", "Say what captured exchanges mean");
  auto options = std::make_shared<DecodeOptions>();
  auto file = std::make_shared<std::string>();
  command->add_option("--protocol", options->protocol, "Protocol")->required();
  command->add_option("--profile", options->profile, "Device profile, for names and units");
  command->add_option("--set", options->set, "Device option, key=value")->take_all();
  command->add_option("--device", options->device, "Of a trace, only this device");
  command->add_option("FILE", *file, "Lines \"> hex\" and \"< hex\"; - for standard input")
      ->required();
  command->callback([options, file, &action] {
    action = [=](const auto& catalog) {
      if (*file == "-") return RunDecode(*options, catalog, std::cin, std::cout, std::cerr);
      std::ifstream stream(*file);
      if (!stream) {
        std::cerr << "baudgate: cannot read " << *file << "\n";
        return kCannotOpen;
      }
      return RunDecode(*options, catalog, stream, std::cout, std::cerr);
    };
  });
}

void AddDemo(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("demo", "Twins, gateway and a live table, without hardware");
  auto options = std::make_shared<DemoOptions>();
  AddSeconds(*command, options->seconds);
  command->add_option("--port", options->port, "Modbus TCP port")
      ->capture_default_str()
      ->check(CLI::Range(1, 65535));
  command->add_option("--domain", options->domain, "DDS domain")->check(CLI::Range(0, 232));
  command->callback([options, &action] {
    action = [=](const auto& catalog) { return RunDemo(*options, catalog, std::cout, std::cerr); };
  });
}

void AddListings(CLI::App& app, Action& action) {
  auto* protocols = app.add_subcommand("protocols", "List protocols, or one with its options");
  auto protocol = std::make_shared<std::string>();
  auto protocol_json = std::make_shared<bool>(false);
  protocols->add_option("NAME", *protocol, "Protocol");
  protocols->add_flag("--json", *protocol_json, "Print JSON");
  protocols->callback([=, &action] {
    action = [=](const auto& catalog) {
      return RunProtocols(*protocol, *protocol_json, catalog, std::cout, std::cerr);
    };
  });
  auto* profiles = app.add_subcommand("profiles", "List profiles, or one with its registers");
  auto profile = std::make_shared<std::string>();
  auto format = std::make_shared<ProfileFormat>(ProfileFormat::table);
  profiles->add_option("NAME", *profile, "Profile");
  auto* json = profiles->add_flag_callback("--json", [format] { *format = ProfileFormat::json; });
  profiles->add_flag_callback("--markdown", [format] { *format = ProfileFormat::markdown; })
      ->excludes(json);
  profiles->callback([=, &action] {
    action = [=](const auto& catalog) {
      return RunProfiles(*profile, *format, catalog, std::cout, std::cerr);
    };
  });
}

void AddSocket(CLI::App& command, std::string& socket) {
  command.add_option("--socket", socket, "Control socket of the gateway, if it is not found");
}

void AddStatus(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("status", "What the running gateway says of lines and devices");
  auto options = std::make_shared<StatusOptions>();
  command->add_option("TARGET", options->target, "LINE or LINE.DEVICE; everything if not given");
  command->add_flag("--json", options->json, "Print one JSON object");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) {
      options->terminal = TerminalView(1);
      return RunStatus(*options, std::cout, std::cerr);
    };
  });
}

void AddRelease(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("release", "Lend a line's port to another program");
  auto options = std::make_shared<ReleaseOptions>();
  command->add_option("LINE", options->line, "Line")->required();
  auto* time = AddDuration(*command, "--for", options->time, "How long, 10min if not given");
  command->add_flag("--end", options->end, "Take it back now")->excludes(time);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunRelease(*options, std::cout, std::cerr); };
  });
}

void AddTrace(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("trace", "Show the bytes of a line as they come and go");
  auto options = std::make_shared<TraceOptions>();
  command->add_option("LINE", options->line, "Line")->required();
  command->add_option("--device", options->device, "Only this device");
  auto* last =
      command->add_flag("--last", options->last, "What has been, from the flight recorder");
  AddSeconds(*command, options->seconds)->excludes(last);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunTrace(*options, std::cout, std::cerr); };
  });
}

void AddWrites(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("writes", "Who has written what, and what became of it");
  auto options = std::make_shared<WritesOptions>();
  command->add_flag("--follow", options->follow, "Go on with what comes");
  command->add_option_function<std::string>(
      "--since",
      [options](const std::string& text) {
        const auto since = ParseSince(text, ReadClocks().wall);
        if (!since) throw CLI::ValidationError("--since", since.error());
        options->since = *since;
      },
      "A time (UTC), or a span before now: 2h");
  command->add_flag("--json", options->json, "Print one JSON object a line");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunWrites(*options, std::cout, std::cerr); };
  });
}

void AddSettings(CLI::App& app, Action& action) {
  auto* settings = app.add_subcommand("settings", "Settings of a relay: keep, compare, restore");
  settings->require_subcommand(1);
  const auto add = [&](const char* name, const char* help, bool needs_file, auto run) {
    auto* command = settings->add_subcommand(name, help);
    auto options = std::make_shared<SettingsOptions>();
    command->add_option("TARGET", options->target, "LINE.DEVICE")->required();
    command->add_option("FILE", options->file, "File of settings")->required(needs_file);
    AddSocket(*command, options->socket);
    command->callback([options, run, &action] {
      action = [=](const auto&) { return run(*options, std::cout, std::cerr); };
    });
    return std::pair(command, options);
  };
  const auto [dump, kept] =
      add("dump", "Write the settings into a new file, or print them", false, RunSettingsDump);
  dump->add_flag("--json", kept->json, "JSON in place of YAML");
  const auto [compare, compared] =
      add("compare", "Show where the relay differs from the file", true, RunSettingsCompare);
  compare->add_flag("--json", compared->json, "Print one JSON object");
  const auto run = [](const SettingsOptions& options, std::ostream& out, std::ostream& err) {
    baudgate::settings::SocketWriter writer(options.socket);
    return RunSettingsRestore(options, writer, out, err);
  };
  const auto [restore, restored] =
      add("restore", "Write to the relay what differs from the file", true, run);
  restore->add_flag("--confirm", restored->confirm, "Write; without it, it is only shown");
}

void AddInUse(CLI::App& app, Action& action, const char* name, const char* help, bool in_use) {
  auto* command = app.add_subcommand(name, help);
  auto options = std::make_shared<InUseOptions>();
  options->in_use = in_use;
  command->add_option("TARGET", options->target, "LINE.DEVICE")->required();
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunInUse(*options, std::cout, std::cerr); };
  });
}

void AddRead(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("read", "Ask a device now for its points");
  auto options = std::make_shared<ReadOptions>();
  command->add_option("TARGET", options->target, "LINE.DEVICE or LINE.DEVICE.POINT")->required();
  command->add_flag("--json", options->json, "Print one JSON object");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunRead(*options, std::cout, std::cerr); };
  });
}

void AddWrite(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("write", "Write a point, and say what became of it");
  auto options = std::make_shared<WriteOptions>();
  command->add_option("TARGET", options->target, "LINE.DEVICE.POINT")->required();
  command->add_option("VALUE", options->value, "In the point's unit; on or off for a bool")
      ->required();
  command->add_flag("--confirm", options->confirm, "You mean it: for points with 'select: yes'");
  command->add_flag("--json", options->json, "Print one JSON object");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunWrite(*options, std::cout, std::cerr); };
  });
}

}  // namespace

void AddCommands(CLI::App& app, Action& action) {
  AddRun(app, action);
  AddCheck(app, action);
  AddCerts(app, action);
  AddMap(app, action);
  AddWatch(app, action);
  AddDiscoveryServer(app, action);
  AddSimulate(app, action);
  AddDecode(app, action);
  AddDemo(app, action);
  AddListings(app, action);
  AddStatus(app, action);
  AddRead(app, action);
  AddWrite(app, action);
  AddRelease(app, action);
  AddTrace(app, action);
  AddWrites(app, action);
  AddSettings(app, action);
  AddInUse(app, action, "enable", "Ask a device again", true);
  AddInUse(app, action, "disable", "Ask a device no more, until the gateway restarts", false);
}

bool IsUnknownSubcommand(const CLI::App& app, std::string_view word) {
  if (word.empty() || word.front() == '-') return false;
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  if (std::find(names.begin(), names.end(), word) != names.end()) return false;
  const std::vector<std::string_view> known(names.begin(), names.end());
  std::cerr << config::Quoted(word) << " is no subcommand;" << config::DidYouMean(word, known)
            << " there are: " << config::Join(known) << '\n';
  return true;
}

}  // namespace baudgate
