// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/writes/request_value.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "gateway/base/text.h"
#include "gateway/bus/writes/value_text.h"

namespace baudgate::dds {
namespace {

constexpr double kExactWhole = 9007199254740992;  // 2^53: beyond, a double skips whole numbers

bool CountsInWholes(config::Type type) {
  return type != config::Type::float32 && type != config::Type::float64;
}

}  // namespace

Result<Value> ValueOf(const config::Point& point, const RequestSample& request) {
  if (!request.text.empty() || point.type == config::Type::string) {
    return ParseValue(point, request.text);
  }
  if (!std::isfinite(request.value)) {
    return Error{"'value' is not a number, and 'text' is empty"};
  }
  if (!CountsInWholes(point.type)) return Value(request.value);
  if (std::abs(request.value) > kExactWhole) {
    return Error{"whole numbers beyond 2^53 are exact in 'text' only"};
  }
  const bool whole = std::trunc(request.value) == request.value;
  return ParseValue(point, whole ? std::to_string(static_cast<std::int64_t>(request.value))
                                 : FormatNumber(request.value));
}

RequestId IdOf(const RequestSample& request) {
  return {request.client, request.seq,
          fmt::format("{}\t{}\t{:a}\t{}\t{}", request.device, request.point, request.value,
                      request.text, request.confirm ? "confirm" : "")};
}

}  // namespace baudgate::dds
