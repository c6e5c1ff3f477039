// Examine() returns what one exchange looked like on the wire: it turns all bytes between a request
// and the next one into a symptom. All functions are pure; gateway/diagnosis/observer.h uses them.
//
//   request 01 03 00 00 00 01 84 0A, then came        symptom
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

/// A piece of the received bytes, which begins at byte `at`.
struct Arrival {
  std::size_t at = 0;
  Duration after{};  ///< from the computed end of the request; negative: before its end
};

/// One exchange and the bytes that came after its end. Pointers and views are borrowed.
struct Hearing {
  const protocols::Protocol* protocol = nullptr;
  const protocols::ParsedOptions* options = nullptr;
  View request{};
  const protocols::Expectation* expect = nullptr;
  Outcome outcome = Outcome::none;  ///< none: the exchange has not ended
  View heard{};
  std::span<const Arrival> arrivals{};                ///< pieces of `heard`; the first begins at 0
  Duration reply{};                                   ///< the longest time until the first byte
  Duration gap{};                                     ///< the longest pause inside a reply
  bool connection = false;                            ///< the line is a TCP connection
  std::span<const protocols::ForeignRule> foreign{};  ///< rules of all protocols
};

Finding Examine(const Hearing& hearing);
/// Returns the finding of an exchange in which only the reply came.
Finding Plain(const Hearing& hearing);
/// Recognises another service or text for people in bytes that came before the first request.
std::optional<Finding> Greeting(const Hearing& hearing, View heard);

// Text for people: a login prompt, a menu, a log. Pure.

/// Returns a quotation such as "'login: '"; a long text is cut.
std::string Quote(View text);
/// Nothing: not text for people. `lines`: any line of printable characters is accepted.
std::optional<Finding> Words(const Hearing& hearing, View heard, bool lines = false);

// Messages of another protocol: binary messages on a line of a text protocol, proven by their check
// value, and texts on any line, proven by their form. Pure.

/// Nothing: no other protocol is recognised.
std::optional<Finding> OtherFrame(const Hearing& hearing, View heard);

// Services that are not serial lines, recognised by what they send over TCP: a web server, SSH,
// TLS, Telnet, IEC 60870-5-104. Pure.

/// Nothing: no known service. `modbus`: a Modbus TCP server is expected, not a serial server.
std::optional<Finding> OtherService(View heard, bool modbus);
/// True if the bytes begin with IAC and WILL, WONT, DO or DONT.
bool IsTelnet(View heard);

}  // namespace baudgate::diagnosis
