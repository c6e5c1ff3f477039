// SPDX-License-Identifier: Apache-2.0
#include "protocols/example/points.h"

#include "gateway/base/text.h"

namespace baudgate::protocols::example {
namespace {

constexpr DecoderSpec kDecoders[] = {{"7", "item 7: a decimal number"}};

}  // namespace

Result<unsigned> ParseItem(const config::Point& point) {
  const auto item = ParseInteger<unsigned>(point.read);
  if (item && *item >= 1 && *item <= 999) return *item;
  return Error{"read '" + point.read + "' is not an item; write a number from 1 to 999"};
}

Status CheckPoint(const config::Point& point) {
  const auto item = ParseItem(point);
  if (!item) return Error{item.error()};
  if (!point.write.empty())
    return Error{"an item is written with the number from read; remove the key write"};
  if (point.type == config::Type::string) return Error{"items are numbers, not text"};
  return {};
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

Decoded DecodeValue(std::string_view content) {
  const auto number = content.starts_with("=") ? ParseDecimal(content.substr(1)) : std::nullopt;
  if (!number) return {{}, Quality::bad_sensor_failure};
  return {*number, Quality::good};
}

std::string EncodeValue(const Value& value) { return "=" + FormatNumber(ToDouble(value)); }

}  // namespace baudgate::protocols::example
