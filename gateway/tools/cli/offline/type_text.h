// "float32", "string(12)", "DT".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/point.h"

namespace baudgate {

inline std::string TypeText(const config::Point& point) {
  if (point.time_type != config::TimeType::none) return config::IecName(point);
  std::string text(config::Name(point.type));
  if (point.type == config::Type::string) text += "(" + std::to_string(point.text_length) + ")";
  return text;
}

}  // namespace baudgate
