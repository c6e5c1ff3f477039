// `baudgate ports`: lists the serial ports of this machine, their names for a configuration, the
// processes that use them, and what prevents the gateway from using them.
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

// A serial port as /sys and the links in /dev describe it. The port is not opened, because that
// would switch DTR and RTS.
struct FoundPort {
  std::string name;    ///< "ttyUSB0"
  std::string driver;  ///< driver in the kernel: "ftdi_sio"; empty: unknown
  /// The members from `at` to `interface` are set only for a USB adapter.
  std::string at;       ///< place on the USB in the kernel's notation: "1-1.2"
  std::string vendor;   ///< vendor id of USB in hex: "0403"
  std::string product;  ///< product id of USB in hex: "6001"
  std::string maker;
  std::string model;
  std::string serial;
  std::string interface;  ///< "00"; the number of the port within its adapter
  /// Stable paths of the port, the best first. If two adapters have the same serial number,
  /// contains only paths that name the USB socket or slot of the adapter.
  std::vector<std::string> links;
  bool twin = false;              ///< true: another adapter has the same model and serial number
  std::optional<int> latency_ms;  ///< how long an FTDI adapter delays received bytes

  std::string path() const { return "/dev/" + name; }
  bool is_usb() const { return !vendor.empty(); }
};

/// Returns the ports sorted by name. Leaves out ports without hardware. `root`: "/", or for tests a
/// folder that contains sys/class/tty and dev.
std::vector<FoundPort> FindPorts(const std::filesystem::path& root);

/// Returns the name of the port to which a path leads. Example: "ttyUSB0" for
/// "/dev/serial/by-id/usb-…"; empty: the link leads to no port.
std::string PortNameOf(const std::filesystem::path& root, const std::string& path);

/// The device file of a port, with its owner, group and mode. Example: /dev/ttyUSB0 root:dialout
/// 0660.
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
  bool is_service = false;  ///< true: the user of baudgate.service
};

bool MayUse(const Person& person, const PortFile& file);
/// Returns why the person cannot open the file, and the remedy. Example: "you are not allowed to
/// open /dev/ttyUSB0: sudo usermod -aG dialout anna, then log in again".
std::string HowToMend(const Person& person, const PortFile& file);

struct PortsOptions {
  bool json = false;
  /// Path of the control socket; empty: the only running gateway is used.
  std::string socket;
};

/// The parts of the machine that ShowPorts uses; tests replace them.
struct PortsPlace {
  std::filesystem::path root = "/";
  std::vector<Person> people;
  /// Returns the answer of `baudgate status --json`; null: no gateway runs.
  std::function<nlohmann::ordered_json()> status;
};

int ShowPorts(bool json, const PortsPlace& place, std::ostream& out);
int RunPorts(const PortsOptions& options, std::ostream& out);

}  // namespace baudgate::tools
