// What the bytes after a request of a scan say: a device, our own request, another master, wrong
// parity, two devices at once. Pure; asked by gateway/tools/scan/scanner.h for every exchange.
//
//   asked ">1RF:21\r"                          what it is
//   nothing                                    silence
//   ">1RF:21\r"                                echo
//   "\n<1D:SPCJ 4D29:18\r\n"                   device
//   the same twice                             device, doubled
//   "\n\xBC1D\xBA…", bit 7 is an even parity   device, its format is 7E1
//   ">2RI1:00\r"                               foreign: another master
//   "\n<1D:SP\x7F\x02"                         garbled
//
// Report is all that a scan has found, and Configuration a configuration of it.
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
  Bytes early{};              ///< came before the request was sent
  Bytes heard{};              ///< came after it
  std::uint32_t damaged = 0;  ///< characters among them with a wrong parity or stop bit
  bool stopped = false;       ///< the user has ended it
};

struct Verdict {
  enum class What : std::uint8_t {
    silence,
    echo,   ///< the request came back, and nothing else
    maybe,  ///< a reply that looks like its echo
    device,
    other,    ///< a whole reply of another device: a late one
    foreign,  ///< a request that somebody else has sent
    damaged,  ///< characters with a wrong parity or stop bit
    garbled,
  };
  What what = What::silence;
  protocols::Sighting sighting{};
  bool echoed = false;   ///< the request came back
  bool doubled = false;  ///< more than one device has answered
  /// The eighth bit of the reply is this parity: it came in seven bits.
  std::optional<config::Parity> parity{};
  std::string text{};  ///< of foreign: a sentence without its full stop
};

Verdict Judge(const Tongue& tongue, std::size_t mode, View request, const Gathered& gathered);

/// Another master on the line.
struct Talk {
  bool known = false;  ///< a protocol has recognised a master
  std::string text{};  ///< a sentence without its full stop
};
/// Says what was heard before anything was sent: "another master speaks on the line: it has asked
/// slave 2 (spabus, 9600 7E1)".
Talk WhoTalks(const std::vector<Tongue>& tongues, View heard, const config::SerialSettings& serial);

// What a scan has found. Made by gateway/tools/scan/scanner.h; goes to the table, the JSON lines
// and the configuration of `baudgate scan`.

struct Found {
  std::string protocol{};
  config::SerialSettings serial{};
  protocols::ScanMode mode{};  ///< the option that it needs
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
