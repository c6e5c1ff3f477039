// `Judge` classifies the bytes that came after a request of a scan: a device, an echo, another
// master, a wrong parity, two devices at once. No I/O, no clock; gateway/tools/scan/scanner.h calls
// it after each exchange.
//
//   received after request ">1RF:21\r"         verdict
//   nothing                                    silence
//   ">1RF:21\r"                                echo
//   "\n<1D:SPCJ 4D29:18\r\n"                   device
//   the same reply twice                       device, doubled
//   "\n\xBC1D\xBA…", bit 7 is an even parity   device, its format is 7E1
//   ">2RI1:00\r"                               foreign: another master
//   "\n<1D:SP\x7F\x02"                         garbled
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"
#include "gateway/tools/scan/plan.h"

namespace baudgate::scan {

struct Gathered {
  Bytes early{};              ///< bytes that were received before the request was sent
  Bytes heard{};              ///< bytes received after the request
  std::uint32_t damaged = 0;  ///< characters in `heard` with a wrong parity or stop bit
  bool stopped = false;       ///< true: the user has ended the scan
};

struct Verdict {
  enum class What : std::uint8_t {
    silence,
    echo,   ///< the request came back, and nothing else
    maybe,  ///< a reply that could also be the echo of its request
    device,
    other,    ///< a complete reply of another device, which answers late
    foreign,  ///< a request of another master
    damaged,  ///< characters with a wrong parity or stop bit
    garbled,
  };
  What what = What::silence;
  protocols::Sighting sighting{};
  bool echoed = false;   ///< true: the request came back before the reply
  bool doubled = false;  ///< true: more than one device has answered
  /// Set if bit 7 of each byte of the reply is a parity bit: the device sends 7 data bits with this
  /// parity.
  std::optional<config::Parity> parity{};
  std::string text{};  ///< for `foreign` and `other`: the cause, without a full stop
};

Verdict Judge(const Tongue& tongue, std::size_t mode, View request, const Gathered& gathered);

/// Traffic on the line before the scan sends anything, as far as it is known.
struct Talk {
  bool known = false;  ///< true: the traffic was recognised as that of a master
  std::string text{};  ///< description: a sentence without a full stop
};
/// Describes bytes that were received before anything was sent. Example: "another master sends on
/// the line: it has asked slave 2 (spabus, 9600 7E1)".
Talk WhoTalks(const std::vector<Tongue>& tongues, View heard, const config::SerialSettings& serial);

// `Found` is one device that a scan has found. gateway/tools/scan/scanner.h makes it; `baudgate
// scan` prints it in a table, as JSON and in a configuration.

struct Found {
  std::string protocol{};
  config::SerialSettings serial{};
  protocols::ScanMode mode{};
  unsigned address = 0;
  std::string identity{};  ///< name that the device reports; empty: it reports no name
  std::string profile{};   ///< empty: no profile fits
  bool assumed = false;    ///< true: `profile` is the usual profile of the protocol, not proven
  std::string point{};     ///< a point of such devices, see protocols::Sighting::point
  unsigned unit = 0;       ///< Modbus unit, 1…247; 0: no unit is free
  bool suspect = false;    ///< true: two devices may have this address
  std::vector<std::string> remarks{};
};

struct Report {
  std::vector<Found> found{};
  bool network = false;  ///< true: the port is a serial server, whose settings are fixed
  bool echo = false;
  bool asked = false;
  bool ended = true;  ///< false: the user or the time limit has ended the scan
  std::vector<std::string> remarks{};
};

/// Key: a protocol; value: for each device name (see SpokenName) the profile that lists the name.
using ProfileNames = std::map<std::string, std::map<std::string, std::string>>;

/// Returns the Modbus unit for a new device: its address if no other device has this unit, else the
/// lowest free unit; 0: no unit is free.
unsigned UnitFor(const std::vector<Found>& others, unsigned address);

/// Adds a remark to each device whose character format is not that of most devices of the same
/// protocol and bit rate.
void RemarkFormats(std::vector<Found>& found);

/// The parts of a configuration that a scan cannot determine.
struct Heading {
  std::string written{};  ///< text of the first comment
  std::string gateway{};
  std::string line{};
  std::string port{};
};
/// Returns a complete configuration with one line. The report must contain at least one device.
std::string Configuration(const Report& report, const Heading& heading);

/// Returns a gateway name made from a host name. Example: "gate_7.plant.example" → "gate_7".
std::string GatewayName(std::string_view host);

}  // namespace baudgate::scan
