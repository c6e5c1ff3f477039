// `Judge` classifies the bytes that came after a request of a scan: a device, an echo, another
// master, a wrong parity, two devices at once. Pure function; gateway/tools/scan/scanner.h calls it
// for every exchange.
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

/// One exchange on the wire.
struct Gathered {
  Bytes early{};              ///< bytes received before the request was sent
  Bytes heard{};              ///< bytes received after the request
  std::uint32_t damaged = 0;  ///< characters in `heard` with a wrong parity or stop bit
  bool stopped = false;       ///< the user has ended the scan
};

struct Verdict {
  enum class What : std::uint8_t {
    silence,
    echo,   ///< the request came back, and nothing else
    maybe,  ///< a reply that is equal to the echo of its request
    device,
    other,    ///< a complete reply of another device, which answers late
    foreign,  ///< a request of another master
    damaged,  ///< characters with a wrong parity or stop bit
    garbled,
  };
  What what = What::silence;
  protocols::Sighting sighting{};
  bool echoed = false;   ///< the request came back
  bool doubled = false;  ///< more than one device has answered
  /// Set if bit 7 of each byte of the reply is this parity: the device sends 7 data bits.
  std::optional<config::Parity> parity{};
  std::string text{};  ///< for `foreign`: a sentence without its full stop
};

Verdict Judge(const Tongue& tongue, std::size_t mode, View request, const Gathered& gathered);

/// Unrequested traffic on the line.
struct Talk {
  bool known = false;  ///< a protocol has recognised a master
  std::string text{};  ///< a sentence without its full stop
};
/// Describes bytes that were received before anything was sent: "another master speaks on the line:
/// it has asked slave 2 (spabus, 9600 7E1)".
Talk WhoTalks(const std::vector<Tongue>& tongues, View heard, const config::SerialSettings& serial);

// `Found` is one device that a scan has found. gateway/tools/scan/scanner.h makes these; `baudgate
// scan` prints them as a table, as JSON lines and as a configuration.

struct Found {
  std::string protocol{};
  config::SerialSettings serial{};
  protocols::ScanMode mode{};  ///< the protocol option that the device needs
  unsigned address = 0;
  std::string identity{};  ///< name that the device reports; empty: it reports none
  std::string profile{};   ///< empty: no profile fits
  bool assumed = false;    ///< the profile is the usual one of the protocol, not proven
  std::string point{};     ///< see Sighting::point
  unsigned unit = 0;       ///< Modbus unit, 1…247; 0: none is free
  bool suspect = false;    ///< two devices may have this address
  std::vector<std::string> remarks{};
};

struct Report {
  std::vector<Found> found{};
  bool network = false;  ///< the port is a serial server that has the serial settings
  bool echo = false;     ///< the bus echoes requests
  bool asked = false;
  bool ended = true;  ///< false: the user or the time limit has ended the scan
  std::vector<std::string> remarks{};
};

/// For each protocol: the profile that lists a device name (SpokenName).
using ProfileNames = std::map<std::string, std::map<std::string, std::string>>;

/// Returns the Modbus unit of a new device: its address if that is free, else the lowest free unit;
/// 0: none is free.
unsigned UnitFor(const std::vector<Found>& others, unsigned address);

/// Adds a remark to devices whose character format differs from that of most devices of their
/// protocol at the same bit rate.
void RemarkFormats(std::vector<Found>& found);

/// The parts of a configuration that a scan cannot find out.
struct Heading {
  std::string written{};  ///< text of the first comment
  std::string gateway{};
  std::string line{};
  std::string port{};
};
/// Returns a complete configuration with one line. The report must contain at least one device.
std::string Configuration(const Report& report, const Heading& heading);

/// Returns a gateway name made from a host name: "gate_7.plant.example" → "gate_7".
std::string GatewayName(std::string_view host);

}  // namespace baudgate::scan
