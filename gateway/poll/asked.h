// One exchange, for the parts of the poller that learn from it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "gateway/base/time.h"
#include "gateway/poll/roster.h"
#include "protocols/conversation.h"

namespace baudgate {

/// At most so many tries beyond `retries`. Example: a server that is three replies late gives the
/// fourth try the reply to the first, and one more try makes up for a lost one.
inline constexpr int kMostTriesMore = 4;
/// To find out how far it is behind.
inline constexpr int kMostProbesMore = 16;

struct Asked {
  const Member* member = nullptr;
  const Request* request = nullptr;
  Instant sent{};           ///< its first byte; until then, when the line was given it
  bool first = false;       ///< of its task, which is no probe; not a repetition
  bool retry = false;       ///< the same request had failed before
  bool probe = false;       ///< the task is a probe
  bool lone_probe = false;  ///< and nothing waits behind it: a look whether the device is back
  bool renews = false;      ///< the line has time: the proof of the device is renewed early

  /// From its last byte to the first one of its reply. A reply that takes longer is late.
  Duration reply_time() const { return std::max(member->times.reply, request->reply); }
  /// The reply says whose it is.
  bool named() const { return !request->expect.address.empty(); }
};

}  // namespace baudgate
