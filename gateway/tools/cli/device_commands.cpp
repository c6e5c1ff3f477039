// The subcommands about a bus or about devices outside a running gateway: their options and help.
// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <iostream>
#include <map>
#include <memory>

#include "gateway/tools/cli/client/operation.h"
#include "gateway/tools/cli/commands.h"
#include "gateway/tools/cli/live/one_port.h"
#include "gateway/tools/cli/offline/new_profile.h"
#include "gateway/tools/cli/offline/profiles.h"
#include "gateway/tools/cli/offline/simulate.h"
#include "gateway/tools/cli/scan/ask.h"
#include "gateway/tools/cli/scan/scan.h"
#include "gateway/tools/simulate/twin_faults.h"
#include "gateway/tools/terminal/live_table.h"
#include "gateway/tools/terminal/words.h"

namespace baudgate::tools {
namespace {

void AddScan(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("scan", "Find the devices on a bus (only reads)");
  SetExample(*command, "baudgate scan /dev/ttyUSB0 --quick");
  auto options = std::make_shared<ScanOptions>();
  command
      ->add_option("TARGET", options->target,
                   "A port (/dev/..., tcp://HOST:PORT), or a line of the running gateway")
      ->required();
  command->add_option("--protocol", options->protocol, "Try this protocol only");
  command->add_option_function<std::string>(
      "--addresses",
      [options = options.get()](const std::string& text) {
        const auto addresses = scan::ParseAddresses(text);
        if (!addresses) throw CLI::ValidationError("--addresses", addresses.error());
        options->addresses = *addresses;
      },
      "Try these addresses only, for example 1-32");
  command->add_flag("--quick", options->quick,
                    "Try usual settings and addresses only; takes less than a minute");
  command->add_flag("--over-traffic", options->over_traffic,
                    "Scan even if another device sends on the line");
  command->add_flag("--rs485", options->rs485,
                    "The driver of the port switches the RS-485 direction");
  command->add_option("--config", options->config,
                      "Write a configuration with the found devices to this file");
  command->add_flag("--force", options->force, "Overwrite the file if it exists");
  command->add_flag("--json", options->json, "Print one JSON object per device");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto& catalog) {
      options->width = TerminalWidth(STDOUT_FILENO);
      return RunScan(*options, catalog, std::cout, std::cerr);
    };
  });
}

void AddAsk(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("ask", "Send one telegram and show the reply");
  SetExample(*command, "baudgate ask /dev/ttyUSB0 '>1RF:XX'");
  auto options = std::make_shared<AskOptions>();
  command
      ->add_option("TARGET", options->target,
                   "A free port (/dev/..., tcp://HOST:PORT), or LINE or LINE.DEVICE of the "
                   "running gateway")
      ->required();
  command->add_option("TELEGRAM", options->telegram, "Text, as '>1RF:XX', or hex")->required();
  command->add_option("--protocol", options->protocol, "Protocol (only for a free port)");
  command->add_option("--serial", options->serial,
                      "Bit rate and format, for example \"9600 7E1\" (only for a free port)");
  command->add_option_function<std::string>(
      "--checksum",
      [options = options.get()](const std::string& kind) {
        options->set.push_back("checksum=" + kind);
      },
      "Checksum: true or false for DCON, crc or ks for SET-4TM (only for a free port)");
  command->add_option("--set", options->set, "Device option, key=value (only for a free port)")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--profile", options->profile, "Device profile, for names and units");
  command->add_flag("--rs485", options->rs485,
                    "The driver of the port switches the RS-485 direction (only for a free port)");
  command->add_flag("--write", options->write, "Send the telegram even if it may write");
  command->add_flag("--json", options->json, "Print one JSON object");
  AddSocket(*command, options->socket);
  command->callback([options, &action] {
    action = [=](const auto& catalog) {
      options->width = TerminalWidth(STDOUT_FILENO);
      return RunAsk(*options, catalog, std::cout, std::cerr);
    };
  });
}

}  // namespace

void AddBusCommands(CLI::App& app, Action& action) {
  AddScan(app, action);
  AddAsk(app, action);
}

namespace {

void AddMisbehaviour(CLI::App& command, const std::shared_ptr<SimulateOptions>& options) {
  command
      .add_option_function<std::vector<std::string>>(
          "--fault",
          [options](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              auto fault = ParseFault(text);
              if (!fault) throw CLI::ValidationError("--fault", fault.error());
              options->faults.push_back(std::move(*fault));
            }
          },
          "Simulate a fault: KIND[:key=value,...], for example loss:rate=0.1; may be repeated")
      ->take_all()
      ->allow_extra_args(false);
  command.add_option_function<std::string>(
      "--events",
      [options](const std::string& text) {
        const auto schedule = ParseEventSchedule(text);
        if (!schedule) throw CLI::ValidationError("--events", schedule.error());
        options->events = *schedule;
      },
      "Raise the events of the profile regularly: every:DURATION[,count=N][,numbered]");
}

void AddSimulate(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand(
      "simulate", "Run simulated devices: one on a pty, or all devices of a configuration");
  SetExample(*command, "baudgate simulate --profile spaj140c --address 1 --pty /tmp/relay");
  auto options = std::make_shared<SimulateOptions>();
  auto all = std::make_shared<SimulateConfigOptions>();
  auto* profile = command->add_option("--profile", options->profile, "Device profile");
  auto* protocol = command->add_option("--protocol", options->protocol,
                                       "Protocol, if it is not the protocol of the profile");
  auto* address = command->add_option("--address", options->address,
                                      "Address on the line, if the device has one");
  auto* pty = command->add_option("--pty", options->pty, "Path of the link to the pty");
  auto* baud = command->add_option("--baud", options->serial,
                                   "Simulate this bit rate and format, for example \"9600 7E1\"");
  profile->needs(pty);
  address->needs(profile);
  pty->needs(profile);
  auto* set = command->add_option("--set", options->set, "Device option, key=value")
                  ->take_all()
                  ->allow_extra_args(false);
  auto* file = command->add_option(
      "-c,--config", all->file,
      "Simulate all devices of this configuration, with a pty or TCP port for each line");
  for (auto* one : {profile, protocol, address, pty, baud, set}) file->excludes(one);
  auto* write = command->add_option(
      "--write", all->write, "Write the configuration with the simulated ports to this file");
  write->needs(file);
  command
      ->add_option("--ports", all->ports,
                   "Folder of the simulated ports; beside the file of --write if not given")
      ->needs(write);
  AddDuration(*command, "--think", options->think_time, "Time before each reply, 5ms if not given");
  AddMisbehaviour(*command, options);
  command->callback([options, all, profile, file, &action] {
    if (profile->empty() && file->empty()) {
      throw CLI::RequiredError("--profile, or -c with a configuration,");
    }
    const bool one = file->empty();
    all->think_time = options->think_time;
    all->faults = options->faults;
    all->events = options->events;
    action = [=](const auto& catalog) {
      return one ? RunSimulate(*options, catalog, std::cout, std::cerr)
                 : RunSimulateConfig(*all, catalog, std::cout, std::cerr);
    };
  });
}

CLI::Option* AddNewProfile(CLI::App& profiles, const std::shared_ptr<NewProfileOptions>& fresh) {
  auto* list = profiles.add_option(
      "--new", fresh->file,
      "Print a Modbus profile made from a register list (CSV). Columns: name, register, type; "
      "optional columns: unit, scale, access, table, order, group, description, example");
  const std::map<std::string, FirstRegister> firsts = {
      {"0", FirstRegister::zero}, {"1", FirstRegister::one}, {"40001", FirstRegister::modicon}};
  profiles
      .add_option_function<std::string>(
          "--first-register", [fresh, firsts](const auto& text) { fresh->first = firsts.at(text); },
          "Number of the first holding register in the list: 0, 1 or 40001")
      ->check(CLI::IsMember({"0", "1", "40001"}))
      ->needs(list);
  profiles
      .add_option("--table", fresh->table,
                  "Table of the registers, if the list does not name it: holding or input")
      ->check(CLI::IsMember({"holding", "input"}))
      ->capture_default_str()
      ->needs(list);
  profiles.add_option("--device", fresh->title, "Title of the new profile")->needs(list);
  return list;
}

void AddProfiles(CLI::App& app, Action& action) {
  auto* profiles =
      app.add_subcommand("profiles", "List profiles, or show, check or make one profile");
  SetExample(*profiles, "baudgate profiles spaj140c");
  auto profile = std::make_shared<std::string>();
  auto format = std::make_shared<ProfileFormat>(ProfileFormat::table);
  auto check = std::make_shared<CheckProfileOptions>();
  auto fresh = std::make_shared<NewProfileOptions>();
  auto* name = profiles->add_option("NAME", *profile, "Profile");
  auto* json = profiles->add_flag_callback(
      "--json", [format] { *format = ProfileFormat::json; }, "Print JSON");
  profiles
      ->add_flag_callback(
          "--markdown", [format] { *format = ProfileFormat::markdown; }, "Print Markdown")
      ->excludes(json);
  auto* file = profiles->add_option("--check", check->file,
                                    "List all errors of this profile file, or print its registers");
  profiles->add_option("--protocol", check->protocol, "Protocol of the file")->needs(file);
  auto* list = AddNewProfile(*profiles, fresh);
  file->excludes(name);
  list->excludes(name)->excludes(file);
  profiles->callback([=, &action] {
    action = [=](const auto& catalog) {
      if (!list->empty()) return RunNewProfile(*fresh, catalog, std::cout, std::cerr);
      const std::size_t width = TerminalWidth(STDOUT_FILENO);
      if (file->empty()) {
        return RunProfiles(*profile, *format, catalog, std::cout, std::cerr, width);
      }
      check->format = *format;
      check->width = width;
      return RunCheckProfile(*check, catalog, std::cout, std::cerr);
    };
  });
}

void AddRead(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand(
      "read", "Read the points of a device now, through the running gateway or at a free port");
  SetExample(*command, "baudgate read bay-1.feeder-1");
  auto options = std::make_shared<ReadOptions>();
  auto direct = std::make_shared<ReadPortOptions>();
  auto* target = command->add_option("TARGET", options->target,
                                     "LINE.DEVICE or LINE.DEVICE.POINT; with --port only POINT");
  command->add_flag("--json", options->json, "Print one JSON object");
  auto* socket =
      command->add_option("--socket", options->socket,
                          "Control socket of the gateway; only needed if the gateway is not found");
  auto* port = command
                   ->add_option("--port", direct->port,
                                "Read without a gateway, at a free port or tcp://host:port")
                   ->excludes(socket);
  auto* profile = command->add_option("--profile", direct->profile, "Device profile")->needs(port);
  command->add_option("--address", direct->address, "Address on the line, if the device has one")
      ->needs(port);
  port->needs(profile);
  command
      ->add_option("--protocol", direct->protocol,
                   "Protocol, if it is not the protocol of the profile")
      ->needs(port);
  command
      ->add_option(
          "--serial", direct->serial,
          "Bit rate and format, for example \"9600 7E1\"; the default of the protocol if not given")
      ->needs(port);
  command->add_option("--option", direct->options, "Device option, key=value")
      ->take_all()
      ->allow_extra_args(false)
      ->needs(port);
  command->callback([=, &action] {
    if (port->empty() && target->empty()) {
      throw CLI::RequiredError("TARGET, or --port with --profile,");
    }
    const bool free = !port->empty();
    direct->point = options->target;
    direct->json = options->json;
    action = [=](const auto& catalog) {
      return free ? RunReadPort(*direct, catalog, std::cout, std::cerr)
                  : RunRead(*options, std::cout, std::cerr);
    };
  });
}

void AddBridge(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("bridge", "Forward Modbus TCP to the Modbus slaves at one port");
  SetExample(*command, "baudgate bridge /dev/ttyUSB0 19200 8E1");
  auto options = std::make_shared<BridgeOptions>();
  command->add_option("PORT", options->port, "/dev/ttyUSB0, or tcp://host:port of a serial server")
      ->required();
  command->add_option("SERIAL", options->serial, "Bit rate and format: 19200 8E1")->expected(0, 2);
  command->add_option("--protocol", options->protocol, "modbus_rtu, modbus_ascii or modbus_tcp")
      ->capture_default_str();
  command->add_option("--listen", options->listen, "ADDRESS or ADDRESS:PORT for Modbus TCP clients")
      ->capture_default_str();
  command
      ->add_option("--allow", options->allow,
                   "Address or network of clients, for example 10.0.0.0/24; required beyond "
                   "loopback; may be repeated")
      ->take_all()
      ->allow_extra_args(false);
  command->add_flag("--read-only", options->read_only, "Refuse every function that writes");
  command->callback([options, &action] {
    action = [=](const auto& catalog) { return RunBridge(*options, catalog, std::cerr); };
  });
}

}  // namespace

void AddDeviceCommands(CLI::App& app, Action& action) {
  AddSimulate(app, action);
  AddProfiles(app, action);
  AddRead(app, action);
  AddBridge(app, action);
}

}  // namespace baudgate::tools
