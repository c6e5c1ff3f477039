// One exchange, for the parts of the poller that learn from it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "protocols/conversation.h"
#include "protocols/transaction.h"

namespace baudgate {

/// The most tries beyond `retries`. Example: a server that is three replies late gives the fourth
/// try the reply to the first, and one more try makes up for a lost one.
inline constexpr int kMostTriesMore = 4;
/// The most probes in a row that find out by how many replies a device lags.
inline constexpr int kMostProbesMore = 16;

struct Asked {
  const Member* member = nullptr;
  const Request* request = nullptr;
  Instant sent{};           ///< its first byte; until then, when the line was given it
  bool first = false;       ///< the first request of a task that is no probe; no repetition
  bool retry = false;       ///< the same request had failed before
  bool probe = false;       ///< the task is a probe
  bool lone_probe = false;  ///< no task waits for it: it finds out whether the device is back
  bool renews_proof_early = false;  ///< because the line has time
  bool proved = false;              ///< the member has answered a probe before this task
  bool unprovable = false;          ///< a probe was wanted before this task, and cannot be asked
  bool writes = false;              ///< the task writes points

  /// When its last byte is out.
  Instant sent_out() const { return sent + TransmissionTime(*request, member->times.character); }
  Duration reply_time() const { return ReplyTime(*request, member->times); }
  /// The reply says whose it is.
  bool named() const { return !request->expect.address.empty(); }
  /// The device has written that itself, and not a converter before it.
  bool names_itself() const { return named() && !request->numbered; }
  /// What is asked, whichever number the request has.
  Bytes question() const { return WithoutNumber(*member->protocol, request->bytes); }
};

}  // namespace baudgate
