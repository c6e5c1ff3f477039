// Parses `read` texts of points, such as "08 1B 00 11 float_le@0", into a request, a decoder and an
// offset.
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

/// The place of a value: the PDU of the request, the decoder, and the offset in the data of the
/// reply.
struct Field {
  Bytes pdu;
  Decoder decoder = Decoder::u8;
  /// Offset of the first byte of the value; for `flag` the number of the flag (1 for E-01).
  std::size_t offset = 0;
  std::size_t count = 0;  ///< number of bytes, for bcd(n) and text_cp1251(n)
};

/// Parses a `read` text. The error names the wrong part and a correct form.
Result<Field> ParseField(std::string_view read);
/// The `write` text of the point that corrects the clock. Other points cannot be written.
inline constexpr std::string_view kCorrectsClock = "03 0B";
/// Returns the `read` text of a field, as ParseField accepts it: "08 1B 00 11 float_le@0".
std::string FieldText(const Field& field);
/// Checks that `read` fits the point's type, and that a written point is the clock correction.
Status CheckPoint(const config::Point& point);
Status CheckType(const Field& field, const config::Point& point);
/// Returns the range of numbers that the field can contain; any number, if it is multiplied by
/// constants.
config::RawNumbers NumbersOf(const Field& field);
Measure MeasureOf(const Field& field);
/// True if the field is a bit of the status word, or `alarm`, which combines these bits.
bool IsFlag(const Field& field);
std::span<const DecoderSpec> DecoderSpecs();

}  // namespace baudgate::protocols::set4tm
