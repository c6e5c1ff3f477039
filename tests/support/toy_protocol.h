// A protocol that exists in tests only, so that the engine is tested without the real plugins.
// Requests come from the poller under test, replies from ToyTwin. The wire format:
//   request   KIND ADDRESS NUMBER [=VALUE] CR     kinds: ? read, L read once (destructive), B read
//                                                 again, U read untagged, O open, C close, W write,
//                                                 P probe, Q write without a reply
//   reply     ! ADDRESS NUMBER [=VALUE | ~WORD] * SUM CR      SUM: sum of the bytes before '*'
//   untagged  ! =VALUE * SUM CR                   as DCON: nothing tells whose answer it is
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "protocols/protocol.h"
#include "tests/support/fixed_values.h"

namespace baudgate {

/// How a point's `read` chooses what is asked: "7" plain, "L7" destructive with B7 in its place,
/// "D7" destructive with nothing in its place, "U7" untagged, "S7" inside a session that is opened
/// first (and closed again after a write, even one that failed), "E7" cannot be asked at all,
/// "Q7" a write without an answer, "N7" a read behind a broadcast, "V7" a point that is only
/// written. A device that has only "V" points cannot be probed.
///
/// Words in a reply: busy, refused, unsupported end the exchange so; closed opens the session and
/// asks again; replan drops the query; fault and nan are readings without a usable value; foreign:
/// the device is another one, until it answers with a value. Address: one letter. Options: wait
/// (duration, after busy).
const protocols::Protocol& ToyProtocol();

/// "!A7=5*XX\r" from "A7=5".
Bytes ToyReply(std::string_view body);

config::Options ToyOptions();

/// Values that stay until they are set; 0 where none was.
inline FixedValues ToyValues() {
  FixedValues values;
  values.fallback = std::int64_t{0};
  return values;
}

}  // namespace baudgate
