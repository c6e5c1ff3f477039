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
#include "gateway/dds/samples.h"
#include "gateway/requests/request_id.h"

namespace baudgate::dds {

/// The error says in one sentence what would be right.
Result<Value> ValueOf(const config::Point& point, const RequestSample& request);
/// What is asked for bit by bit, so that a NaN is the same NaN. Its times are no part of it.
RequestId IdOf(const RequestSample& request);

}  // namespace baudgate::dds
