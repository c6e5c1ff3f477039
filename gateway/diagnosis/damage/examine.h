// Examine() returns what one exchange looked like on the wire: a symptom for all bytes between a
// request and the next request. No function does I/O or reads a clock. `Observer` uses them.
// Examples:
//
//   request 01 03 00 00 00 01 84 0A, then came        symptom
//   nothing                                           silence
//   01 03 00 00 00 01 84 0A                           echo
//   01 03 02 …80 ms… 00 4B F9 B3                      split, 80 ms
//   03 02 00 4B F9 B3                                 head_lost
//   01 03 02                                          tail_lost
//   Login:                                            text
//
// OtherFrame recognises messages of another protocol, OtherService recognises other services, such
// as a web server.
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

/// When a piece of the received bytes came. `at`: index of its first byte.
struct Arrival {
  std::size_t at = 0;
  Duration after{};  ///< from the computed end of the request; negative: before it
};

/// One exchange, with the bytes that came after its end. The object contains pointers and views of
/// data that must stay valid.
struct Hearing {
  const protocols::Protocol* protocol = nullptr;
  const protocols::ParsedOptions* options = nullptr;
  View request{};
  const protocols::Expectation* expect = nullptr;
  Outcome outcome = Outcome::none;  ///< none: the exchange has not ended
  View heard{};
  std::span<const Arrival> arrivals{};  ///< pieces of `heard`; the first begins at index 0
  Duration reply{};                     ///< reply time: the longest time until the first byte
  Duration gap{};                       ///< longest pause inside a reply
  bool connection = false;              ///< the line is a TCP connection
  /// Rules that recognise the messages of all installed protocols.
  std::span<const protocols::ForeignRule> foreign{};
};

Finding Examine(const Hearing& hearing);
/// Returns the finding of an exchange in which only the reply came.
Finding Plain(const Hearing& hearing);
/// Recognises another service, or readable text, in bytes that came before the first request.
std::optional<Finding> Greeting(const Hearing& hearing, View heard);

// Readable text, such as a login prompt, a menu or a log.

/// Returns a quotation, such as "'login: '". A long text is cut.
std::string Quote(View text);
/// Returns a finding if the bytes are readable text. `lines`: any line of printable characters
/// counts.
std::optional<Finding> Words(const Hearing& hearing, View heard, bool lines = false);

// Messages of another protocol: binary messages on a line of a text protocol are recognised by
// their check value, texts on any line by their form.

std::optional<Finding> OtherFrame(const Hearing& hearing, View heard);

// Services that are not serial lines, recognised by what they send over TCP: a web server, SSH,
// TLS, Telnet, IEC 60870-5-104.

/// Returns a finding if the bytes come from a service such as a web server. `modbus`: a Modbus TCP
/// server is expected, not a serial server.
std::optional<Finding> OtherService(View heard, bool modbus);
/// True if the bytes begin with a Telnet negotiation: IAC and WILL, WONT, DO or DONT.
bool IsTelnet(View heard);

}  // namespace baudgate::diagnosis
