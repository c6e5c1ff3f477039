// A protocol for tests only, so that the engine is tested without the real plugins. The poller
// under test sends the requests, ToyTwin replies. The wire format:
//   request   KIND ADDRESS NUMBER [=VALUE] CR     kinds: ? read, L read once (destructive), B read
//                                                 again, U read untagged, O open, C close, W write,
//                                                 P probe, Q write without a reply
//   reply     ! ADDRESS NUMBER [=VALUE | ~WORD] * SUM CR      SUM: sum of the bytes before '*'
//   untagged  ! =VALUE * SUM CR                   as in DCON: the reply contains no address
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "protocols/protocol.h"
#include "tests/support/fixed_values.h"

namespace baudgate {

/// A point's `read` chooses its request:
///
///   7    plain                         E7   cannot be requested
///   L7   destructive; B7 repeats it    Q7   a write without a reply
///   D7   destructive, never repeated   N7   a read after a broadcast
///   U7   untagged                      V7   a write-only point; with these alone: no probe
///   S7   inside a session, which is opened first and closed after every write
///
/// Words in a reply: busy, refused and unsupported end the exchange with that outcome; `odd` is a
/// refusal of unexpected form. `closed` opens the session and repeats the request, `replan` drops
/// the query. `fault` and `nan` are readings without a usable value, `events` is a batch of events,
/// `foreign` is another device (until a value comes). Address: a letter. Option: wait (after busy).
const protocols::Protocol& ToyProtocol();

/// Returns a whole reply. Example: "!A7=5*XX\r" for "A7=5".
Bytes ToyReply(std::string_view body);

config::Options ToyOptions();

/// Returns values that stay until they are set, 0 at first.
inline FixedValues ToyValues() {
  FixedValues values;
  values.fallback = std::int64_t{0};
  return values;
}

}  // namespace baudgate
