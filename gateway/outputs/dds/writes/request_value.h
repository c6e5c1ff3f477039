// The value that a write request means for a point. `text` counts unless it is empty, and always
// for a text; then `value`:
//
//   uint16   value 1               1
//   uint64   text "12345678901234567890"
//   bool     value 1, text "on"    true
//   float32  value nan             an error
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"
#include "gateway/bus/writes/request_id.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

/// The error says in one sentence what would be right.
Result<Value> ValueOf(const config::Point& point, const RequestSample& request);
/// Its content has every bit of the value, so two NaNs are equal. It has neither of the two times,
/// which may differ when a client repeats its request.
RequestId IdOf(const RequestSample& request);

}  // namespace baudgate::dds
