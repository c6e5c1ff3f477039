// SPDX-License-Identifier: Apache-2.0
#include "protocols/example/values.h"

#include "gateway/base/text.h"

namespace baudgate::protocols::example {

Decoded DecodeValue(std::string_view content) {
  const auto number = content.starts_with("=") ? ParseDecimal(content.substr(1)) : std::nullopt;
  if (!number) return {{}, Quality::bad_sensor_failure};
  return {*number, Quality::good};
}

std::string EncodeValue(const Value& value) { return "=" + FormatNumber(ToDouble(value)); }

}  // namespace baudgate::protocols::example
