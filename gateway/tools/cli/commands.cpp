// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/commands.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <map>
#include <vector>

#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/outputs/users/user_file.h"
#include "gateway/tools/cli/live/demo.h"
#include "gateway/tools/cli/live/run.h"
#include "gateway/tools/cli/offline/certs.h"
#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/cli/offline/decode.h"
#include "gateway/tools/cli/offline/map.h"
#include "gateway/tools/cli/offline/profiles.h"
#include "gateway/tools/cli/offline/users.h"
#include "gateway/tools/terminal/live_table.h"
#include "gateway/tools/terminal/words.h"

namespace baudgate::tools {
namespace {

bool IsNumber(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

bool IsFormat(std::string_view word) {
  constexpr std::string_view kParities = "NEOneo";
  return word.size() == 3 && word[0] >= '5' && word[0] <= '8' &&
         kParities.find(word[1]) != std::string_view::npos && (word[2] == '1' || word[2] == '2');
}

/// The innermost subcommand in the command line, with its full name. Example: "baudgate certs dds".
struct Command {
  const CLI::App* app;
  std::string name;
};
Command LastOf(const CLI::App& app) {
  Command command{&app, app.get_name()};
  for (auto inner = app.get_subcommands(); !inner.empty(); inner = command.app->get_subcommands()) {
    command = {inner.front(), command.name + " " + inner.front()->get_name()};
  }
  return command;
}

std::vector<std::string> OptionsOf(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<std::string> CommandsOf(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::string MeantBy(const std::string& word, const Command& command) {
  const std::vector<std::string> options = OptionsOf(*command.app);
  const bool is_option = word.starts_with('-');
  const bool takes_file = std::ranges::find(options, "--config") != options.end();
  if (takes_file && (word.ends_with(".yaml") || word.ends_with(".yml"))) {
    return "give the file with -c: " + command.name + " -c " + word;
  }
  const std::vector<std::string> names = is_option ? options : CommandsOf(*command.app);
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string_view meant = Nearest(word.substr(0, word.find('=')), known);
  return meant.empty() ? std::string()
                       : command.name + ": did you mean " + std::string(meant) + "?";
}

}  // namespace

std::optional<std::string> UnquotedSerial(std::span<char* const> words) {
  for (std::size_t i = 0; i + 2 < words.size(); ++i) {
    const std::string_view option = words[i];
    const bool split = (option == "--serial" || option == "--baud") && IsNumber(words[i + 1]) &&
                       IsFormat(words[i + 2]);
    if (!split) continue;
    return std::string(option) + ": bit rate and format are one word; write " +
           std::string(option) + " \"" + words[i + 1] + " " + words[i + 2] + "\"";
  }
  return std::nullopt;
}

void TellMeant(const CLI::App& app, std::ostream& err) {
  const Command command = LastOf(app);
  for (const std::string& word : app.remaining(true)) {
    const std::string meant = MeantBy(word, command);
    if (!meant.empty()) err << meant << '\n';
  }
}

}  // namespace baudgate::tools

namespace baudgate::tools {
namespace {

void AddConfig(CLI::App& command, std::string& file) {
  file = kInstalledConfig;
  command.add_option("-c,--config", file, "Configuration file")->capture_default_str();
}

void AddRun(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("run", "Run the gateway in the foreground");
  SetExample(*command, "baudgate run -c baudgate.yaml");
  auto file = std::make_shared<std::string>();
  AddConfig(*command, *file);
  command->callback([file, &action] {
    action = [file](const auto& catalog) { return RunDaemon(*file, catalog); };
  });
}

void AddCheck(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("check", "Check a configuration and list every error");
  SetExample(*command, "baudgate check -c baudgate.yaml");
  auto file = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  AddConfig(*command, *file);
  command->add_flag("--json", *json, "Print one JSON object");
  command->callback([file, json, &action] {
    action = [=](const auto& catalog) {
      return RunCheck(*file, catalog, std::cout, std::cerr, *json);
    };
  });
}

void AddServerCerts(CLI::App& certs, Action& action) {
  using Use = ServerCertsOptions::Use;
  const auto add = [&](const char* name, const char* what, Use use, const char* example) {
    auto* command =
        certs.add_subcommand(name, std::string("Make an authority and certificates for TLS of ") +
                                       what + ", or renew the certificates");
    SetExample(*command, example);
    auto options = std::make_shared<ServerCertsOptions>();
    options->use = use;
    command->add_option("DIR", options->directory, "Folder; created if it is missing")->required();
    command
        ->add_option("--name", options->names,
                     "Host name or address of the gateway; repeat the option for more names")
        ->take_all()
        ->allow_extra_args(false);
    command->callback([options, &action] {
      action = [options](const auto&) { return RunServerCerts(*options, std::cout, std::cerr); };
    });
  };
  add("web", "the page", Use::web, "baudgate certs web /etc/baudgate/web --name gate.example.com");
  add("modbus", "Modbus, for the gateway and for clients with the roles viewer and operator",
      Use::modbus, "baudgate certs modbus /etc/baudgate/modbus --name gate.example.com");
  add("ports", "served and lent ports", Use::ports,
      "baudgate certs ports /etc/baudgate/ports --name gate.example.com");
}

void AddCerts(CLI::App& app, Action& action) {
  auto* certs = app.add_subcommand("certs", "Make certificates");
  certs->require_subcommand(1);
  constexpr const char* kExample = "baudgate certs dds pki --gateway substation-7 --subscribers 1";
  SetExample(*certs, kExample);
  auto* command = certs->add_subcommand("dds", "Make an authority and identities for DDS Security");
  SetExample(*command, kExample);
  auto options = std::make_shared<CertsOptions>();
  command->add_option("DIR", options->directory, "Folder; created if it is missing")->required();
  command
      ->add_option("--gateway", options->gateways,
                   "Name of a gateway; repeat the option for more gateways")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--subscribers", options->subscribers, "Number of subscribers")
      ->check(CLI::Range(0, 100));
  command->add_option("--writers", options->writers, "Number of subscribers that can also write")
      ->check(CLI::Range(0, 100));
  command->callback([options, &action] {
    action = [options](const auto&) { return RunCerts(*options, std::cout, std::cerr); };
  });
  AddServerCerts(*certs, action);
}

void AddUsers(CLI::App& app, Action& action) {
  using What = UsersOptions::What;
  auto* users = app.add_subcommand("users", "Add, remove and list users, and make their tokens");
  users->require_subcommand(1);
  SetExample(*users, "baudgate users add anna --role operator");
  const auto add = [&](const char* name, const char* help, What what, const char* example) {
    auto* command = users->add_subcommand(name, help);
    SetExample(*command, example);
    auto options = std::make_shared<UsersOptions>();
    options->what = what;
    options->file = users::kDefaultFile;
    command->add_option("--file", options->file, "Users file")->capture_default_str();
    if (what != What::list) {
      command->add_option("NAME", options->name, "Name of the user, or @GROUP of the system")
          ->required();
    }
    command->callback([options, &action] {
      action = [options](const auto&) {
        return RunUsers(*options, std::cin, std::cout, std::cerr);
      };
    });
    return std::pair(command, options);
  };
  const auto [adds, added] = add("add", "Add a user, or give a user another role and password",
                                 What::add, "baudgate users add anna --role operator");
  adds->add_option("--role", added->role, "viewer, operator, engineer or auditor")->required();
  adds->add_flag("--no-password", added->no_password, "The user can log in only with tokens");
  const auto [tokens, token] = add("token", "Make a token for a program and print it once",
                                   What::token, "baudgate users token prometheus --days 365");
  tokens->add_option("--days", token->days, "Days until the token ends")
      ->check(CLI::Range(1, 3650))
      ->capture_default_str();
  add("remove", "Remove a user and its tokens", What::remove, "baudgate users remove anna");
  add("list", "List users, their roles, and until when their tokens are valid", What::list,
      "baudgate users list");
}

void AddAudit(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("audit", "Show or verify logins and acts of users");
  SetExample(*command, "baudgate audit --verify");
  auto options = std::make_shared<JournalOptions>();
  AddConfig(*command, options->config);
  command->add_flag("--verify", options->verify, "Check that no row was changed or is missing");
  command->add_flag("--json", options->json, "Print one JSON object per line");
  command->callback([options, &action] {
    action = [options](const auto& catalog) {
      return RunAudit(*options, catalog, std::cout, std::cerr);
    };
  });
}

void AddMap(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("map", "Print the registers and topics of every point");
  SetExample(*command, "baudgate map -c baudgate.yaml");
  auto file = std::make_shared<std::string>();
  auto format = std::make_shared<MapFormat>(MapFormat::table);
  AddConfig(*command, *file);
  static const std::map<std::string, MapFormat> kFormats = {{"table", MapFormat::table},
                                                            {"csv", MapFormat::csv},
                                                            {"json", MapFormat::json},
                                                            {"st", MapFormat::structured_text},
                                                            {"markdown", MapFormat::markdown}};
  auto* named = command
                    ->add_option_function<std::string>(
                        "--format", [format](const auto& name) { *format = kFormats.at(name); },
                        "Output format; st is Structured Text of IEC 61131-3")
                    ->check(CLI::IsMember({"table", "csv", "json", "st", "markdown"}));
  auto* csv = command
                  ->add_flag_callback(
                      "--csv", [format] { *format = MapFormat::csv; }, "Short for --format csv")
                  ->excludes(named);
  command
      ->add_flag_callback(
          "--json", [format] { *format = MapFormat::json; }, "Short for --format json")
      ->excludes(csv)
      ->excludes(named);
  command->callback([file, format, &action] {
    action = [=](const auto& catalog) {
      return RunMap(*file, catalog, *format, std::cout, std::cerr);
    };
  });
}

void AddWatch(CLI::App& app, Action& action) {
  // All words behind "watch" are passed to baudgate-dds, which parses them.
  auto* command =
      app.add_subcommand("watch", "Show values, events and alarms that gateways publish on DDS");
  command->set_help_flag();
  command->prefix_command();
  command->callback([command, &action] {
    action = [words = command->remaining()](const auto& catalog) {
      return RunWatch(words, catalog, std::cerr);
    };
  });
}

void AddDiscoveryServer(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand(
      "discovery-server", "Help gateways and DDS subscribers to find each other without multicast");
  SetExample(*command, "baudgate discovery-server --listen 10.0.0.5:11811");
  auto listen = std::make_shared<std::string>("127.0.0.1:11811");
  command
      ->add_option("--listen", *listen,
                   "ADDRESS:PORT of this machine; 0.0.0.0 for all its addresses")
      ->capture_default_str();
  command->callback([listen, &action] {
    action = [listen](const auto&) { return RunDiscoveryServer(*listen, std::cerr); };
  });
}

void AddDecode(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("decode", "Decode captured requests and replies");
  SetExample(*command, "baudgate decode bay-1.trace");
  auto options = std::make_shared<DecodeOptions>();
  auto file = std::make_shared<std::string>();
  command->add_option(
      "--protocol", options->protocol,
      "Protocol; only needed if the file lacks the head that 'baudgate trace' prints");
  command->add_option("--profile", options->profile, "Device profile, for names and units");
  command->add_option("--set", options->set, "Device option, key=value")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--device", options->device, "Decode this device of a trace only");
  auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "Print one JSON object per line, also in a terminal");
  command
      ->add_option(
          "FILE", *file,
          "Output of 'baudgate trace', or lines \"> hex\" and \"< hex\"; - is standard input")
      ->required();
  command->callback([options, file, json, &action] {
    action = [=](const auto& catalog) {
      if (const auto terminal = TerminalView(STDOUT_FILENO); terminal && !*json) {
        options->prose = true;
        options->width = terminal->width;
      }
      if (*file == "-") return RunDecode(*options, catalog, std::cin, std::cout, std::cerr);
      std::ifstream stream(*file);
      if (!stream) {
        std::cerr << "baudgate: cannot read " << *file << "\n";
        return kExitCanNot;
      }
      return RunDecode(*options, catalog, stream, std::cout, std::cerr);
    };
  });
}

void AddDemo(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand(
      "demo", "Run simulated devices, a gateway and a live table, without hardware");
  SetExample(*command, "baudgate demo --seconds 30");
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

void AddProtocols(CLI::App& app, Action& action) {
  auto* protocols =
      app.add_subcommand("protocols", "List protocols, or show one protocol with its options");
  SetExample(*protocols, "baudgate protocols spabus");
  auto protocol = std::make_shared<std::string>();
  auto protocol_json = std::make_shared<bool>(false);
  protocols->add_option("NAME", *protocol, "Protocol");
  protocols->add_flag("--json", *protocol_json, "Print JSON");
  protocols->callback([=, &action] {
    action = [=](const auto& catalog) {
      return RunProtocols(*protocol, *protocol_json, catalog, std::cout, std::cerr);
    };
  });
}

}  // namespace

void AddCommands(CLI::App& app, Action& action) {
  AddRun(app, action);
  AddCheck(app, action);
  AddCerts(app, action);
  AddUsers(app, action);
  AddAudit(app, action);
  AddMap(app, action);
  AddWatch(app, action);
  AddDiscoveryServer(app, action);
  AddDecode(app, action);
  AddDemo(app, action);
  AddProtocols(app, action);
  AddDeviceCommands(app, action);
  AddClientCommands(app, action);
}

bool IsUnknownSubcommand(const CLI::App& app, std::string_view word) {
  if (word.empty() || word.front() == '-') return false;
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  if (std::find(names.begin(), names.end(), word) != names.end()) return false;
  const std::vector<std::string_view> known(names.begin(), names.end());
  std::cerr << Quoted(word) << " is no subcommand;" << DidYouMean(word, known)
            << " there are: " << Join(known) << '\n';
  return true;
}

}  // namespace baudgate::tools
