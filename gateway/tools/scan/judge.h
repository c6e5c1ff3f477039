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
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

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
  Sighting sighting{};
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

}  // namespace baudgate::scan
