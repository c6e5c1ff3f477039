// The subcommands that talk to a running gateway: their options and help.
// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <iostream>
#include <memory>
#include <optional>

#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/tools/cli/bundle/support_bundle.h"
#include "gateway/tools/cli/client/history.h"
#include "gateway/tools/cli/client/operation.h"
#include "gateway/tools/cli/client/records.h"
#include "gateway/tools/cli/client/status.h"
#include "gateway/tools/cli/commands.h"
#include "gateway/tools/cli/ports/ports.h"
#include "gateway/tools/cli/settings/settings.h"
#include "gateway/tools/cli/trace.h"
#include "gateway/tools/terminal/live_table.h"
#include "gateway/tools/terminal/words.h"

namespace baudgate::tools {
namespace {

/// Adds an option that takes a time. `target` must live as long as the command.
void AddTime(CLI::App& command, const std::string& name, std::optional<WallTime>& target) {
  command.add_option_function<std::string>(
      name,
      [name, &target](const std::string& text) {
        const auto time = ParseSince(text, ReadClocks().wall);
        if (!time) throw CLI::ValidationError(name, time.error());
        target = *time;
      },
      "A time (UTC), or a span before now: 2h");
}

void AddSince(CLI::App& command, std::optional<WallTime>& since) {
  AddTime(command, "--since", since);
}

void AddStatus(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("status", "Show the state of lines and devices");
  auto options = std::make_shared<StatusOptions>();
  command->add_option("TARGET", options->target, "LINE or LINE.DEVICE; everything if not given");
  auto* json = command->add_flag("--json", options->json, "Print one JSON object");
  auto* watch = command
                    ->add_flag("--watch", options->watch,
                               "Show it again each second, the worst first, until Ctrl-C")
                    ->excludes(json);
  AddSeconds(*command, options->seconds)->needs(watch);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) {
      options->terminal = TerminalView(STDOUT_FILENO);
      if (!options->watch) return RunStatus(*options, std::cout, std::cerr);
      if (const Status possible = LiveScreen::Possible(STDOUT_FILENO); !possible) {
        std::cerr << "baudgate: status --watch: " << possible.error()
                  << "; ask with 'baudgate status' or 'baudgate status --json' again and again\n";
        return kExitUsage;
      }
      return RunStatusWatch(*options, std::cout, std::cerr);
    };
  });
}

void AddRelease(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("release", "Lend a line's port to another program");
  auto options = std::make_shared<ReleaseOptions>();
  command->add_option("LINE", options->line, "Line")->required();
  auto* time = AddDuration(*command, "--for", options->time, "How long, 10min if not given");
  auto* tcp = command->add_option("--tcp", options->tcp,
                                  "Lend it over the network to a client that comes in here: "
                                  "ADDRESS:PORT");
  command->add_flag("--rfc2217", options->rfc2217, "The client may set the port by RFC 2217")
      ->needs(tcp);
  command
      ->add_option("--allow", options->allow,
                   "Who may come in: an address or a network; needed beyond loopback")
      ->needs(tcp);
  command->add_flag("--end", options->end, "Take the port back now")->excludes(time)->excludes(tcp);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunRelease(*options, std::cout, std::cerr); };
  });
}

void AddTrace(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("trace", "Show the frames of a line as they come and go");
  auto options = std::make_shared<TraceOptions>();
  command->add_option("LINE", options->line, "Line")->required();
  command->add_option("--device", options->device, "Only this device");
  auto* last =
      command->add_flag("--last", options->last, "The last frames, from the flight recorder");
  command->add_flag("--bytes", options->bytes, "Bytes as they arrive, in place of decoded frames");
  AddSeconds(*command, options->seconds)->excludes(last);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto& catalog) { return RunTrace(*options, catalog, std::cout, std::cerr); };
  });
}

void AddWrites(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("writes", "List writes: who wrote what, and the result");
  auto options = std::make_shared<WritesOptions>();
  command->add_flag("--follow", options->follow, "Then show each new one");
  AddSince(*command, options->since);
  command->add_flag("--json", options->json, "Print one JSON object a line");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) {
      options->width = TerminalWidth(STDOUT_FILENO);
      return RunWrites(*options, std::cout, std::cerr);
    };
  });
}

void AddEvents(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("events", "Show events of devices and of the gateway, oldest first");
  auto options = std::make_shared<EventsOptions>();
  command->add_flag("--follow", options->follow, "Then show each new one");
  command->add_option("--from", options->from, "The first number (seq)")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 62U));
  command->add_option("--device", options->device, "Only this device: DEVICE or LINE.DEVICE");
  AddSince(*command, options->since);
  auto* json = command->add_flag("--json", options->json, "Print one JSON object a line");
  command->add_flag("--csv", options->csv, "Print a table for spreadsheets")->excludes(json);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) {
      options->width = TerminalWidth(STDOUT_FILENO);
      return RunEvents(*options, std::cout, std::cerr);
    };
  });
}

void AddAlarms(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand(
      "alarms", "Show what is wrong, and what was wrong and is not acknowledged");
  auto options = std::make_shared<AlarmsOptions>();
  command->add_flag("--follow", options->follow, "Then show each change");
  command->add_flag("--json", options->json, "Print one JSON object a line");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) {
      options->width = TerminalWidth(STDOUT_FILENO);
      return RunAlarms(*options, std::cout, std::cerr);
    };
  });
}

void AddAck(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("ack", "Acknowledge alarms");
  auto options = std::make_shared<AckOptions>();
  command
      ->add_option("TARGET", options->target,
                   "LINE, LINE.DEVICE, LINE.DEVICE.POINT or the number (seq) of an event")
      ->required();
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunAck(*options, std::cout, std::cerr); };
  });
}

void AddHistory(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("history", "Show values of the past, or their means, minima and maxima");
  auto options = std::make_shared<HistoryOptions>();
  command
      ->add_option("POINT", options->points,
                   "LINE.DEVICE.POINT, each with * for any text, or "
                   "LINE.DEVICE.load_1.active_import and the like; with --billing LINE.DEVICE")
      ->required();
  AddSince(*command, options->since);
  AddTime(*command, "--until", options->until);
  auto* billing = command->add_flag("--billing", options->billing,
                                    "Billing readings of meters, by day and month and tariffs");
  auto* every = command->add_option_function<std::string>(
      "--every",
      [options = options.get()](const std::string& text) {
        const auto every = ParseDuration(text);
        if (!every) throw CLI::ValidationError("--every", every.error());
        if (*every < 1min || *every % 1min != Duration::zero()) {
          throw CLI::ValidationError("--every", "write whole minutes, for example 15min or 1d");
        }
        if (*every > 24h * 31) throw CLI::ValidationError("--every", "31d at most");
        options->every = *every;
      },
      "Means, minima and maxima of such spans, for example 15min");
  every->excludes(billing);
  auto* json = command->add_flag("--json", options->json, "Print one JSON object a line");
  command->add_flag("--csv", options->csv, "Print a table for spreadsheets")->excludes(json);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    if (options->since && options->until && *options->until <= *options->since) {
      throw CLI::ValidationError("--until", "it has to be later than --since");
    }
    action = [=](const auto&) {
      options->width = TerminalWidth(STDOUT_FILENO);
      return options->billing ? RunBilling(*options, std::cout, std::cerr)
                              : RunHistory(*options, std::cout, std::cerr);
    };
  });
}

void AddSettings(CLI::App& app, Action& action) {
  auto* settings =
      app.add_subcommand("settings", "Keep, compare and restore the settings of a relay");
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
  restore->add_flag("--confirm", restored->confirm, "Write; without this option it is only shown");
}

void AddPorts(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand(
      "ports", "List serial ports: their names, who uses them, who may open them");
  auto options = std::make_shared<PortsOptions>();
  command->add_flag("--json", options->json, "Print one JSON object");
  AddSocket(*command, options->socket);
  command->callback(
      [options, &action] { action = [=](const auto&) { return RunPorts(*options, std::cout); }; });
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

void AddWrite(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("write", "Write a point, and show the result");
  auto options = std::make_shared<WriteOptions>();
  command->add_option("TARGET", options->target, "LINE.DEVICE.POINT")->required();
  command->add_option("VALUE", options->value, "In the point's unit; on or off for a bool")
      ->required();
  command->add_flag("--confirm", options->confirm,
                    "Confirm the write of a point with 'select: yes'");
  command
      ->add_option("--request", options->request,
                   "NAME/NUMBER of your own: the same again is answered, and not written twice")
      ->check([](const std::string& text) {
        const auto slash = text.rfind('/');
        const bool named = slash != std::string::npos && slash > 0;
        const auto number = ParseInteger<std::int64_t>(text.substr(slash + 1));
        const bool numbered = named && number && *number >= 0;
        return numbered ? std::string() : "'" + text + "' is not NAME/NUMBER, as in night/7";
      });
  command->add_flag("--json", options->json, "Print one JSON object");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunWrite(*options, std::cout, std::cerr); };
  });
}

void AddReload(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("reload", "Apply the changed configuration file");
  auto options = std::make_shared<ReloadCommand>();
  auto* dry = command->add_flag("--dry-run", options->dry_run, "Only show what would change");
  auto confirm = std::make_shared<Duration>();
  auto* given = AddDuration(*command, "--confirm", *confirm,
                            "Go back after this time, unless 'baudgate confirm' comes");
  given->excludes(dry);
  command->add_flag("--json", options->json, "Print one JSON object");
  AddSocket(*command, options->socket);
  command->callback([options, confirm, given, &action] {
    if (given->count() > 0) options->confirm = *confirm;
    action = [=](const auto&) { return RunReload(*options, std::cout, std::cerr); };
  });
}

void AddConfirm(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("confirm", "Confirm the configuration on trial");
  auto options = std::make_shared<ConfirmCommand>();
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunConfirm(*options, std::cout, std::cerr); };
  });
}

void AddSupportBundle(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("support-bundle", "Make an archive for a bug report, without secrets");
  auto options = std::make_shared<BundleOptions>();
  command->add_option("FILE", options->file, "A new file, for example bundle.tar.gz")->required();
  command->add_option("-c,--config", options->config,
                      "Configuration file, if it is not that of the running gateway");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto& catalog) {
      return RunSupportBundle(*options, catalog, ReadClocks().wall, std::cout, std::cerr);
    };
  });
}

}  // namespace

void AddClientCommands(CLI::App& app, Action& action) {
  AddStatus(app, action);
  AddWrite(app, action);
  AddRelease(app, action);
  AddTrace(app, action);
  AddWrites(app, action);
  AddEvents(app, action);
  AddAlarms(app, action);
  AddAck(app, action);
  AddHistory(app, action);
  AddSettings(app, action);
  AddReload(app, action);
  AddConfirm(app, action);
  AddPorts(app, action);
  AddBusCommands(app, action);
  AddInUse(app, action, "enable", "Ask a device again", true);
  AddInUse(app, action, "disable", "Stop asking a device, until the gateway restarts", false);
  AddSupportBundle(app, action);
}

}  // namespace baudgate::tools
