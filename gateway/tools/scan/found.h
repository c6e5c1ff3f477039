// What a scan has found. Made by gateway/tools/scan/scanner.h; goes to the table, the JSON lines
// and the configuration of `baudgate scan`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/serial.h"

namespace baudgate::scan {

struct Found {
  std::string protocol{};
  config::SerialSettings serial{};
  ScanMode mode{};  ///< the option that it needs
  unsigned address = 0;
  std::string identity{};  ///< what it calls itself; empty: it does not say
  std::string profile{};   ///< empty: there is none for it
  bool assumed = false;    ///< the profile is the protocol's usual one, and not proven
  std::string point{};     ///< see Sighting
  unsigned unit = 0;       ///< for Modbus, 1…247; 0: there are too many devices
  bool suspect = false;    ///< two devices may have this address
  std::vector<std::string> remarks{};
};

struct Report {
  std::vector<Found> found{};
  bool network = false;  ///< the server has the serial settings
  bool echo = false;     ///< the bus gives requests back
  bool asked = false;    ///< something was sent
  bool ended = true;     ///< false: the user or the time has ended it before
  std::vector<std::string> remarks{};
};

/// By protocol: which profile lists a name (SpokenName).
using ProfileNames = std::map<std::string, std::map<std::string, std::string>>;

/// The unit of the next device: its own address where that is free, else the lowest that is.
unsigned UnitFor(const std::vector<Found>& others, unsigned address);

/// Devices with another character format than the others of their protocol at the same bit rate get
/// a remark.
void RemarkFormats(std::vector<Found>& found);

/// What a bus does not tell.
struct Heading {
  std::string written{};  ///< for the first comment
  std::string gateway{};  ///< its name
  std::string line{};
  std::string port{};
};
/// A whole configuration with one line, of one device at least.
std::string Configuration(const Report& report, const Heading& heading);

/// A name for a gateway, made of this machine's: "gate_7.plant.example" → "gate_7".
std::string GatewayName(std::string_view host);

}  // namespace baudgate::scan
