// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/integers.h"

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/snapshot.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr std::uint8_t kTemperature = 0x70;  // the parameter
constexpr std::uint8_t kAskTemperature = 0x01;
constexpr std::uint8_t kAskOne = 0x11;
constexpr std::uint8_t kAskFour = 0x16;
constexpr std::size_t kFloatSize = 4;
constexpr std::size_t kIntegerSize = 3;

}  // namespace

Decoder IntegerDecoder(std::uint8_t parameter) {
  const unsigned mode = parameter >> 4U;
  const unsigned kind = (parameter >> 2U) & 3U;
  switch (mode) {
    case 0x0:
      if (kind == 0) return Decoder::power_be;
      return kind == 1 ? Decoder::reactive_be : Decoder::apparent_be;
    case 0x1:
    case 0xA:
      return Decoder::voltage_be;
    case 0x2:
      return kind == 0 ? Decoder::current_be : Decoder::hundredths_be;
    case 0x3:
      return kind == 0 ? Decoder::factor_be : Decoder::hundredths_be;
    case 0xE:
      return kind == 0 ? Decoder::power_be : Decoder::reactive_be;
    default:
      return Decoder::hundredths_be;
  }
}

std::optional<Field> AsInteger(const Field& field) {
  if (field.decoder != Decoder::float_le) return std::nullopt;
  const auto parameter = ParameterAt(field.pdu, field.offset);
  if (!parameter) return std::nullopt;
  // There is no integer of it among the others.
  if (*parameter == kTemperature) return Field{{kRead, kAskTemperature}, Decoder::i8, 1, 0};
  const bool group = field.pdu[2] == 2;
  const Bytes pdu = {kRead, group ? kAskFour : kAskOne, field.pdu[3]};
  return Field{pdu, IntegerDecoder(*parameter), field.offset / kFloatSize * kIntegerSize, 0};
}

}  // namespace baudgate::protocols::set4tm
