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

/// A point's `read` chooses its request: "7" plain, "L7" destructive with B7 to repeat it, "D7"
/// destructive without a repetition, "U7" untagged, "S7" inside a session that is opened first (and
/// closed after a write, even after a failed one), "E7" cannot be requested, "Q7" a write without a
/// reply, "N7" a read after a broadcast, "V7" a write-only point. A device with "V" points only
/// cannot be probed.
///
/// Words in a reply: busy, refused and unsupported end the exchange with that outcome; closed opens
/// the session and repeats the request; replan drops the query; fault and nan are readings without
/// a usable value; foreign: another device is at this address until it answers with a value.
/// Address: one letter. Option: wait (a duration, after busy).
const protocols::Protocol& ToyProtocol();

/// Returns "!A7=5*XX\r" for "A7=5".
Bytes ToyReply(std::string_view body);

config::Options ToyOptions();

/// Returns values that stay until they are set, 0 at first.
inline FixedValues ToyValues() {
  FixedValues values;
  values.fallback = std::int64_t{0};
  return values;
}

}  // namespace baudgate
