// The `read` grammar of points, "08 1B 00 11 float_le@0", and the decoders behind it: from the data
// bytes of a reply to a value, and back for the twin.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "protocols/protocol.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

enum class Decoder : std::uint8_t {
  float_le,
  u8,
  i8,
  u16_be,
  u32_be,
  bcd,
  counts,
  energy,
  voltage_be,
  current_be,
  power_be,
  reactive_be,
  apparent_be,
  factor_be,
  hundredths_be,
  text_cp1251,
  version,
  date,
  time,
  time_min,
  clock,
  drift,
  latched,
  flag,
  alarm,
};

/// Where a value stands: the request's PDU and the place in the reply's data.
struct Field {
  Bytes pdu;
  Decoder decoder = Decoder::u8;
  std::size_t offset = 0;  ///< first data byte = 0; of `flag`: E-01 = 1
  std::size_t count = 0;   ///< bytes of bcd(n) and text_cp1251(n)
};

/// An error names the part that is wrong and what would be right.
Result<Field> ParseField(std::string_view read);
/// `write` of a point that corrects the clock.
inline constexpr std::string_view kCorrectsClock = "03 0B";
/// The form that ParseField reads: "08 1B 00 11 float_le@0".
std::string FieldText(const Field& field);
/// Whether `read` is a field, its value can be of the point's type, and nothing is written.
Status CheckPoint(const config::Point& point);
/// Whether the field's value can be a point of this type.
Status CheckType(const Field& field, const config::Point& point);
/// What its bytes can say; of what is multiplied by constants any number.
config::RawNumbers NumbersOf(const Field& field);
/// Which constants the value needs.
Measure MeasureOf(const Field& field);
/// Whether it is a named bit of the status word, or stands for all of them.
bool IsFlag(const Field& field);
std::span<const DecoderSpec> DecoderSpecs();

}  // namespace baudgate::protocols::set4tm
