// How a write ended, from the replies and from what its points show. Pure; used by the poller.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/point.h"
#include "gateway/base/outcome.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/device_record.h"
#include "gateway/bus/schedule/write_queue.h"
#include "gateway/bus/writes/write_command.h"

namespace baudgate {

/// `sent`: a request that may have written went out. `may_have_acted`: as Answer says of a refusal.
WriteEnd WriteEndOf(Outcome outcome, bool sent, bool may_have_acted = false);

/// As users see it.
Value WrittenValue(const config::Point& point, const PointWrite& write);

/// What a point shows after its write was confirmed.
enum class Shown {
  nothing,
  written,  ///< numbers may differ by rounding
  between,  ///< the old value and the written one: a slewing output from 4 to 20 that shows 11
  another,
};
Shown Compare(const config::Point& point, const PointWrite& write, const Value& shown);

struct ReadBackVerdict {
  WriteResult result;
  bool lost = false;  ///< an expected reading did not come
};
/// The verdict on a command that its device has confirmed, from what `record` shows since then. A
/// point that has not been read decides nothing.
ReadBackVerdict VerdictOn(const WriteQueue::Confirmed& one, const DeviceRecord& record);

}  // namespace baudgate
