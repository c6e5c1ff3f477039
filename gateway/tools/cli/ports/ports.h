// `baudgate ports`: the serial ports of this machine, what to call them in a configuration, who has
// them, and what keeps the gateway from having them. FindPorts finds the ports, and HowToMend gives
// the command that lets a person open one.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace baudgate::tools {

// The serial ports of the machine, as /sys and the links in /dev tell of them. Nothing is opened:
// opening a port moves its DTR and RTS.
struct FoundPort {
  std::string name;    ///< "ttyUSB0"
  std::string driver;  ///< "ftdi_sio"; empty: unknown
  /// Only of a USB adapter, from its descriptors; else empty.
  std::string at;       ///< where it is plugged, as the kernel counts: "1-1.2"
  std::string vendor;   ///< "0403"
  std::string product;  ///< "6001"
  std::string maker;
  std::string model;
  std::string serial;
  std::string interface;  ///< "00"; of an adapter with several ports each has its own
  /// Names that stay, best first. Where two adapters say the same serial number, only those by
  /// place.
  std::vector<std::string> links;
  bool twin = false;              ///< another adapter says the same serial number
  std::optional<int> latency_ms;  ///< how long an FTDI adapter holds bytes back

  std::string path() const { return "/dev/" + name; }
  bool is_usb() const { return !vendor.empty(); }
};

/// In the order of their names; ports of a board without hardware behind them are none. `root`:
/// "/", or a tree with sys/class/tty and dev.
std::vector<FoundPort> FindPorts(const std::filesystem::path& root);

/// The port that a configured path leads to: "ttyUSB0" of "/dev/serial/by-id/usb-…"; empty: none.
std::string PortNameOf(const std::filesystem::path& root, const std::string& path);

// Who may open a serial port, and the command that lets somebody who may not.

/// The file of a port: /dev/ttyUSB0 root:dialout 0660.
struct PortFile {
  std::string path;
  uid_t owner = 0;
  gid_t group = 0;
  std::string group_name;
  mode_t mode = 0;
};

struct Person {
  std::string name;
  uid_t id = 0;
  std::vector<gid_t> groups;
  bool is_service = false;  ///< the user of baudgate.service
};

bool MayUse(const Person& person, const PortFile& file);
/// "you may not open /dev/ttyUSB0: sudo usermod -aG dialout anna, then log in again".
std::string HowToMend(const Person& person, const PortFile& file);

struct PortsOptions {
  bool json = false;
  std::string socket;  ///< of the gateway; empty: the default places
};

/// What of it is the machine's.
struct PortsPlace {
  std::filesystem::path root = "/";
  std::vector<Person> people;
  /// As `baudgate status --json`; null: no gateway runs.
  std::function<nlohmann::ordered_json()> status;
};

/// Exit code 0, ports or none.
int ShowPorts(bool json, const PortsPlace& place, std::ostream& out);
/// The same of this machine.
int RunPorts(const PortsOptions& options, std::ostream& out);

}  // namespace baudgate::tools
