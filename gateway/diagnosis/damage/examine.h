// What one exchange looked like on the wire: from all that came between its request and the next
// one to a symptom. Pure; used by gateway/diagnosis/observer.h.
//
//   asked 01 03 00 00 00 01 84 0A, and came           symptom
//   nothing                                           silence
//   01 03 00 00 00 01 84 0A                           echo
//   01 03 02 …80 ms… 00 4B F9 B3                      split, 80 ms
//   03 02 00 4B F9 B3                                 head_lost
//   01 03 02                                          tail_lost
//   Login:                                            text
//
// OtherFrame recognises messages of another protocol, and OtherService other services, such as a
// web server.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "protocols/protocol.h"

namespace baudgate::diagnosis {

/// A piece of what came: from byte `at` on.
struct Arrival {
  std::size_t at = 0;
  Duration after{};  ///< from the computed end of the request; below zero: before it
};

/// One exchange, and what came after it.
struct Hearing {
  const protocols::Protocol* protocol = nullptr;
  const protocols::ParsedOptions* options = nullptr;
  View request{};
  const protocols::Expectation* expect = nullptr;
  Outcome outcome = Outcome::none;  ///< none: it was not judged yet
  View heard{};
  std::span<const Arrival> arrivals{};                ///< of `heard`; the first stands at 0
  Duration reply{};                                   ///< the longest until the first byte
  Duration gap{};                                     ///< the longest pause inside
  bool connection = false;                            ///< it came over TCP
  std::span<const protocols::ForeignRule> foreign{};  ///< of all protocols
};

Finding Examine(const Hearing& hearing);
/// What is found in an exchange in which nothing but the reply came.
Finding Plain(const Hearing& hearing);
/// What came before the first request, if it is another service or words.
std::optional<Finding> Greeting(const Hearing& hearing, View heard);

// Words for people in what came: a login, a menu, a log. Pure.

/// "'login: '", cut where it is long.
std::string Quote(View text);
/// Empty: these are no words for people. `lines`: a whole line of printable characters counts, too.
std::optional<Finding> Words(const Hearing& hearing, View heard, bool lines = false);

// Messages of another protocol: binary ones on a line of a text protocol, as their check value
// proves, and texts on any line, as their form proves.
// Pure.

/// Empty: none is recognised.
std::optional<Finding> OtherFrame(const Hearing& hearing, View heard);

// Other services than a line of devices, by what they say over TCP: a web server, SSH, TLS, Telnet,
// IEC 60870-5-104.
// Pure.

/// Empty: no known service. `modbus`: a Modbus TCP server is expected there, not a serial server.
std::optional<Finding> OtherService(View heard, bool modbus);
/// IAC and WILL, WONT, DO or DONT, at the front.
bool IsTelnet(View heard);

}  // namespace baudgate::diagnosis
