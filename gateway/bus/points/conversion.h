// Between what a device says and what users see: sentinels, scale and offset, the range of the
// point's type, and `min` and `max` of what can only be read. A value that does not fit becomes bad
// quality, never another number.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "protocols/conversation.h"

namespace baudgate {

/// `reading.point` is a valid index.
Sample ToSample(const config::Point& point, const Reading& reading);

/// A value as users write it, turned into the raw value that the protocol sends.
Result<Value> ToRaw(const config::Point& point, const Value& value);

}  // namespace baudgate
