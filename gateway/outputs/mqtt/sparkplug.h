// `Payload` is a message of Sparkplug B (Eclipse Sparkplug 3.0.0, chapter 6): Encode and Decode
// convert it to and from Protocol Buffers. Only the fields that the gateway uses exist here;
// Decode skips all others.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/value.h"

namespace baudgate::mqtt::sparkplug {

/// The data types of metrics, by their numbers in Sparkplug B.
enum class DataType : std::uint32_t {
  int8 = 1,
  int16 = 2,
  int32 = 3,
  int64 = 4,
  uint8 = 5,
  uint16 = 6,
  uint32 = 7,
  uint64 = 8,
  float32 = 9,
  float64 = 10,
  boolean = 11,
  string = 12,
};
/// Returns the type in which values of the point are published. A whole number with scale or offset
/// is published as float64, because its values may have decimals.
DataType TypeOf(const config::Point& point);

/// The values of the property "Quality" (6.4.6, tck-id-payloads-propertyset-quality-value-value).
enum class QualityCode : std::uint32_t { bad = 0, good = 192, stale = 500 };

struct Metric {
  std::string name{};  ///< empty: the metric has only its alias
  std::optional<std::uint64_t> alias{};
  std::optional<std::uint64_t> timestamp{};  ///< milliseconds since 1970, UTC
  DataType type = DataType::string;
  bool historical = false;
  Value value{};  ///< empty: is_null
  std::optional<QualityCode> quality{};
};

struct Payload {
  std::uint64_t timestamp = 0;
  std::vector<Metric> metrics{};
  std::optional<std::uint64_t> seq{};
};

std::string Encode(const Payload& payload);
/// Nothing: the bytes are no payload. A metric without a type has DataType::string, and its value
/// as it is in the message.
std::optional<Payload> Decode(std::string_view bytes);

}  // namespace baudgate::mqtt::sparkplug
