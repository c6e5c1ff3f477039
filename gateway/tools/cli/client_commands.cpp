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

/// `target` must stay valid as long as `command`.
void AddTime(CLI::App& command, const std::string& name, std::optional<WallTime>& target) {
  command.add_option_function<std::string>(
      name,
      [name, &target](const std::string& text) {
        const auto time = ParseSince(text, ReadClocks().wall);
        if (!time) throw CLI::ValidationError(name, time.error());
        target = *time;
      },
      "A time in UTC, or a span before now, for example 2h");
}

void AddSince(CLI::App& command, std::optional<WallTime>& since) {
  AddTime(command, "--since", since);
}

void AddStatus(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("status", "Show the state of lines and devices");
  SetExample(*command, "baudgate status bay-1");
  auto options = std::make_shared<StatusOptions>();
  command->add_option("TARGET", options->target,
                      "LINE or LINE.DEVICE; all lines and devices if not given");
  auto* json = command->add_flag("--json", options->json, "Print one JSON object");
  auto* watch =
      command
          ->add_flag("--watch", options->watch,
                     "Refresh every second, the worst lines and devices first, until Ctrl-C")
          ->excludes(json);
  AddSeconds(*command, options->seconds)->needs(watch);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) {
      options->terminal = TerminalView(STDOUT_FILENO);
      if (!options->watch) return RunStatus(*options, std::cout, std::cerr);
      if (const Status possible = LiveScreen::Possible(STDOUT_FILENO); !possible) {
        std::cerr << "baudgate: status --watch: " << possible.error()
                  << "; run 'baudgate status' or 'baudgate status --json' repeatedly instead\n";
        return kExitUsage;
      }
      return RunStatusWatch(*options, std::cout, std::cerr);
    };
  });
}

void AddRelease(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("release", "Lend a line's port to another program");
  SetExample(*command, "baudgate release bay-1 --for 10min");
  auto options = std::make_shared<ReleaseOptions>();
  command->add_option("LINE", options->line, "Line")->required();
  auto* time = AddDuration(*command, "--for", options->time,
                           "How long the port is lent; 10min if not given");
  auto* tcp =
      command->add_option("--tcp", options->tcp,
                          "Lend the port over the network: a client connects to this ADDRESS:PORT");
  command
      ->add_flag("--rfc2217", options->rfc2217,
                 "The client can change the settings of the port (RFC 2217)")
      ->needs(tcp);
  command
      ->add_option("--allow", options->allow,
                   "Address or network of the client; required beyond loopback")
      ->needs(tcp);
  command->add_flag("--end", options->end, "Take the port back now")->excludes(time)->excludes(tcp);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunRelease(*options, std::cout, std::cerr); };
  });
}

void AddTrace(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("trace", "Show the frames of a line live");
  SetExample(*command, "baudgate trace bay-1 --device feeder-1");
  auto options = std::make_shared<TraceOptions>();
  command->add_option("LINE", options->line, "Line")->required();
  command->add_option("--device", options->device, "Show this device only");
  auto* last = command->add_flag("--last", options->last,
                                 "Show the last frames that the gateway has recorded");
  command->add_flag("--bytes", options->bytes,
                    "Show bytes as they arrive instead of decoded frames");
  AddSeconds(*command, options->seconds)->excludes(last);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto& catalog) { return RunTrace(*options, catalog, std::cout, std::cerr); };
  });
}

void AddWrites(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("writes", "List writes: who wrote what, and the result");
  SetExample(*command, "baudgate writes --since 2h");
  auto options = std::make_shared<WritesOptions>();
  command->add_flag("--follow", options->follow,
                    "After the list, show each new write, until Ctrl-C");
  AddSince(*command, options->since);
  command->add_flag("--json", options->json, "Print one JSON object per line");
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
  SetExample(*command, "baudgate events --since 1d --device feeder-1");
  auto options = std::make_shared<EventsOptions>();
  command->add_flag("--follow", options->follow,
                    "After the list, show each new event, until Ctrl-C");
  command->add_option("--from", options->from, "Begin with the event that has this number (seq)")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 62U));
  command->add_option("--device", options->device, "Show this device only: DEVICE or LINE.DEVICE");
  command
      ->add_option("--priority", options->priority,
                   "Show events of alarms of this priority only; none: events without an alarm")
      ->check(CLI::IsMember({"high", "medium", "low", "none"}));
  AddSince(*command, options->since);
  auto* json = command->add_flag("--json", options->json, "Print one JSON object per line");
  command->add_flag("--csv", options->csv, "Print CSV for spreadsheets")->excludes(json);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) {
      options->width = TerminalWidth(STDOUT_FILENO);
      return RunEvents(*options, std::cout, std::cerr);
    };
  });
}

void AddAlarms(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("alarms", "Show alarms that are active or not acknowledged");
  SetExample(*command, "baudgate alarms --follow");
  auto options = std::make_shared<AlarmsOptions>();
  command->add_flag("--follow", options->follow, "After the list, show each change, until Ctrl-C");
  command->add_flag("--json", options->json, "Print one JSON object per line");
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
  SetExample(*command, "baudgate ack bay-1.feeder-1");
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
      app.add_subcommand("history", "Show stored values, or their means, minima and maxima");
  SetExample(*command, "baudgate history bay-1.feeder-1.current_l1 --since 1d --every 15min");
  auto options = std::make_shared<HistoryOptions>();
  command
      ->add_option("POINT", options->points,
                   "LINE.DEVICE.POINT, where * is any text; for a load profile "
                   "LINE.DEVICE.load_1.active_import; for --billing LINE.DEVICE")
      ->required();
  AddSince(*command, options->since);
  AddTime(*command, "--until", options->until);
  auto* billing = command->add_flag("--billing", options->billing,
                                    "Show billing readings of meters by day, month and tariff");
  auto* every = command->add_option_function<std::string>(
      "--every",
      [options = options.get()](const std::string& text) {
        const auto every = ParseDuration(text);
        if (!every) throw CLI::ValidationError("--every", every.error());
        if (*every < 1min || *every % 1min != Duration::zero()) {
          throw CLI::ValidationError("--every", "write whole minutes, for example 15min or 1d");
        }
        if (*every > 24h * 31) throw CLI::ValidationError("--every", "write at most 31d");
        options->every = *every;
      },
      "Show mean, minimum and maximum of each span, for example 15min");
  every->excludes(billing);
  auto* json = command->add_flag("--json", options->json, "Print one JSON object per line");
  command->add_flag("--csv", options->csv, "Print CSV for spreadsheets")->excludes(json);
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    if (options->since && options->until && *options->until <= *options->since) {
      throw CLI::ValidationError("--until", "write a time later than --since");
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
      app.add_subcommand("settings", "Save, compare and restore the settings of a relay");
  settings->require_subcommand(1);
  SetExample(*settings, "baudgate settings dump bay-1.feeder-1 relay.yaml");
  const auto add = [&](const char* name, const char* help, bool needs_file, auto run) {
    auto* command = settings->add_subcommand(name, help);
    SetExample(*command, std::string("baudgate settings ") + name + " bay-1.feeder-1 relay.yaml");
    auto options = std::make_shared<SettingsOptions>();
    command->add_option("TARGET", options->target, "LINE.DEVICE")->required();
    command->add_option("FILE", options->file, "Settings file")->required(needs_file);
    AddSocket(*command, options->socket);
    command->callback([options, run, &action] {
      action = [=](const auto&) { return run(*options, std::cout, std::cerr); };
    });
    return std::pair(command, options);
  };
  const auto [dump, kept] =
      add("dump", "Write the settings into a new file, or print them", false, RunSettingsDump);
  dump->add_flag("--json", kept->json, "Write JSON instead of YAML");
  const auto [compare, compared] =
      add("compare", "Show where the relay differs from the file", true, RunSettingsCompare);
  compare->add_flag("--json", compared->json, "Print one JSON object");
  const auto run = [](const SettingsOptions& options, std::ostream& out, std::ostream& err) {
    baudgate::settings::SocketWriter writer(options.socket);
    return RunSettingsRestore(options, writer, out, err);
  };
  const auto [restore, restored] =
      add("restore", "Write the settings that differ from the file to the relay", true, run);
  restore->add_flag("--confirm", restored->confirm,
                    "Write the settings; without this option they are only shown");
}

void AddPorts(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("ports", "List serial ports with their names, users and access rights");
  SetExample(*command, "baudgate ports");
  auto options = std::make_shared<PortsOptions>();
  command->add_flag("--json", options->json, "Print one JSON object");
  AddSocket(*command, options->socket);
  command->callback(
      [options, &action] { action = [=](const auto&) { return RunPorts(*options, std::cout); }; });
}

void AddInUse(CLI::App& app, Action& action, const char* name, const char* help, bool in_use) {
  auto* command = app.add_subcommand(name, help);
  SetExample(*command, std::string("baudgate ") + name + " bay-1.feeder-1");
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
  SetExample(*command, "baudgate write bay-1.feeder-1.setting_group 1 --confirm");
  auto options = std::make_shared<WriteOptions>();
  command->add_option("TARGET", options->target, "LINE.DEVICE.POINT")->required();
  command->add_option("VALUE", options->value, "In the point's unit; on or off for a bool")
      ->required();
  command->add_flag("--confirm", options->confirm,
                    "Needed for points that have 'select: yes': confirms this write");
  command
      ->add_option("--request", options->request,
                   "NAME/NUMBER of this request, as you choose; the gateway writes once, even if "
                   "you repeat the request")
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
  SetExample(*command, "baudgate reload --confirm 60s");
  auto options = std::make_shared<ReloadCommand>();
  auto* dry = command->add_flag("--dry-run", options->dry_run, "Only show what would change");
  auto confirm = std::make_shared<Duration>();
  auto* given = AddDuration(
      *command, "--confirm", *confirm,
      "Go back to the confirmed configuration after this time, unless you run 'baudgate confirm'");
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
  SetExample(*command, "baudgate confirm");
  auto options = std::make_shared<ConfirmCommand>();
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunConfirm(*options, std::cout, std::cerr); };
  });
}

void AddRevert(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("revert", "Take back the configuration on trial before its time is over");
  SetExample(*command, "baudgate revert");
  auto options = std::make_shared<ConfirmCommand>();
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto&) { return RunRevert(*options, std::cout, std::cerr); };
  });
}

void AddSupportBundle(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("support-bundle", "Make an archive for a bug report, without secrets");
  SetExample(*command, "baudgate support-bundle bundle.tar.gz");
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
  AddRevert(app, action);
  AddPorts(app, action);
  AddBusCommands(app, action);
  AddInUse(app, action, "enable", "Poll a device again", true);
  AddInUse(app, action, "disable", "Stop polling a device until the gateway restarts", false);
  AddSupportBundle(app, action);
}

}  // namespace baudgate::tools
