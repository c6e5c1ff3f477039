// Between what a device says and what users see: sentinels, scale and offset, and the range of the
// point's type. A value that does not fit becomes bad quality, never another number.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/store/point_store.h"
#include "protocols/conversation.h"

namespace baudgate {

/// `reading.point` is a valid index.
Sample ToSample(const config::Point& point, const Reading& reading);

/// A value as users write it, turned into the raw value that the protocol sends.
Result<Value> ToRaw(const config::Point& point, const Value& value);

/// The decimal number that a float32 stands for: 30.3 for 30.299999237060547 in 64 bits. A number
/// that is not a float32, or has no more digits than one needs (1834523.25), stays as it is.
double AsDecimal(double number);

}  // namespace baudgate
