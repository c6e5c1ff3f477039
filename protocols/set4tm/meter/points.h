// Parses `read` texts, "08 1B 00 11 float_le@0", into a request, a decoder and an offset.
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

/// The place of a value: the request's PDU, and the offset in the reply's data.
struct Field {
  Bytes pdu;
  Decoder decoder = Decoder::u8;
  std::size_t offset = 0;  ///< first byte of the value, from 0; for `flag` its number, E-01 is 1
  std::size_t count = 0;   ///< bytes of bcd(n) and text_cp1251(n)
};

/// The error names the wrong part and what would be correct.
Result<Field> ParseField(std::string_view read);
/// The `write` text of a point that corrects the clock.
inline constexpr std::string_view kCorrectsClock = "03 0B";
/// Returns the text that ParseField accepts: "08 1B 00 11 float_le@0".
std::string FieldText(const Field& field);
/// Checks that `read` fits the point's type, and that only the clock correction is written.
Status CheckPoint(const config::Point& point);
Status CheckType(const Field& field, const config::Point& point);
/// Returns which numbers the field can contain; any, if it is multiplied by constants.
config::RawNumbers NumbersOf(const Field& field);
/// Returns the kind of quantity, which decides the constants that the value needs.
Measure MeasureOf(const Field& field);
/// True for a bit of the status word, and for `alarm`, which combines them.
bool IsFlag(const Field& field);
std::span<const DecoderSpec> DecoderSpecs();

}  // namespace baudgate::protocols::set4tm
