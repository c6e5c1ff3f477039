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

// A serial port as /sys and the links in /dev describe it. It is not opened: that would switch DTR
// and RTS.
struct FoundPort {
  std::string name;    ///< "ttyUSB0"
  std::string driver;  ///< "ftdi_sio"; empty: unknown
  /// The following members are only set for a USB adapter, from its descriptors.
  std::string at;       ///< USB place in the kernel's notation: "1-1.2"
  std::string vendor;   ///< "0403"
  std::string product;  ///< "6001"
  std::string maker;
  std::string model;
  std::string serial;
  std::string interface;  ///< "00"; each port of an adapter with several ports has another number
  /// Stable paths, best first; only paths by place if two adapters have the same serial number.
  std::vector<std::string> links;
  bool twin = false;              ///< another adapter has the same serial number
  std::optional<int> latency_ms;  ///< how long an FTDI adapter delays received bytes

  std::string path() const { return "/dev/" + name; }
  bool is_usb() const { return !vendor.empty(); }
};

/// Returns the ports sorted by name, without ports that have no hardware. `root`: "/", or a tree
/// with sys/class/tty and dev.
std::vector<FoundPort> FindPorts(const std::filesystem::path& root);

/// Returns "ttyUSB0" for "/dev/serial/by-id/usb-…"; empty: the path leads to no port.
std::string PortNameOf(const std::filesystem::path& root, const std::string& path);

/// The device file of a port: /dev/ttyUSB0 root:dialout 0660.
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
/// Returns "you may not open /dev/ttyUSB0: sudo usermod -aG dialout anna, then log in again".
std::string HowToMend(const Person& person, const PortFile& file);

struct PortsOptions {
  bool json = false;
  std::string socket;  ///< of the gateway; empty: the default places
};

/// What ShowPorts needs from the machine; tests replace it.
struct PortsPlace {
  std::filesystem::path root = "/";
  std::vector<Person> people;
  /// Returns the answer of `baudgate status --json`; null: no gateway runs.
  std::function<nlohmann::ordered_json()> status;
};

int ShowPorts(bool json, const PortsPlace& place, std::ostream& out);
int RunPorts(const PortsOptions& options, std::ostream& out);

}  // namespace baudgate::tools
