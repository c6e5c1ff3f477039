// The serial ports of the machine, as /sys and the links in /dev tell of them. Nothing is opened:
// opening a port moves its DTR and RTS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace baudgate {

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

}  // namespace baudgate
