// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/points.h"

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/latch.h"

namespace baudgate::protocols::set4tm {
namespace {

enum class ValueKind : std::uint8_t { number, text, truth };

struct DecoderRow {
  Decoder decoder;
  std::string_view name;
  ValueKind kind;
  std::size_t size;  ///< number of data bytes; 0: it is the n in name(n)
  Measure measure = Measure::plain;
};

constexpr DecoderRow kDecoders[] = {
    {Decoder::float_le, "float_le", ValueKind::number, 4},
    {Decoder::u8, "u8", ValueKind::number, 1},
    {Decoder::i8, "i8", ValueKind::number, 1},
    {Decoder::u16_be, "u16_be", ValueKind::number, 2},
    {Decoder::u32_be, "u32_be", ValueKind::number, 4},
    {Decoder::bcd, "bcd", ValueKind::number, 0},
    {Decoder::counts, "counts", ValueKind::number, 4},
    {Decoder::energy, "energy", ValueKind::number, 4, Measure::energy},
    {Decoder::voltage_be, "voltage_be", ValueKind::number, 3, Measure::voltage},
    {Decoder::current_be, "current_be", ValueKind::number, 3, Measure::current},
    {Decoder::power_be, "power_be", ValueKind::number, 3, Measure::power},
    {Decoder::reactive_be, "reactive_be", ValueKind::number, 3, Measure::power},
    {Decoder::apparent_be, "apparent_be", ValueKind::number, 3, Measure::power},
    {Decoder::factor_be, "factor_be", ValueKind::number, 3, Measure::hundredths},
    {Decoder::hundredths_be, "hundredths_be", ValueKind::number, 3, Measure::hundredths},
    {Decoder::text_cp1251, "text_cp1251", ValueKind::text, 0},
    {Decoder::version, "version", ValueKind::text, 3},
    {Decoder::date, "date", ValueKind::text, 3},
    {Decoder::time, "time", ValueKind::text, 7},
    {Decoder::time_min, "time_min", ValueKind::text, 6},
    {Decoder::clock, "clock", ValueKind::number, 8},
    {Decoder::drift, "drift", ValueKind::number, 8},
    {Decoder::latched, "latched", ValueKind::number, 7},
    {Decoder::flag, "flag", ValueKind::truth, 1},
    {Decoder::alarm, "alarm", ValueKind::truth, 5},
};

constexpr DecoderSpec kSpecs[] = {
    {"float_le@n",
     "IEEE-754 single, low byte first (08 1B, 08 23), converted to a primary value by the ratios"},
    {"u8@n", "unsigned byte"},
    {"i8@n", "signed byte; example: 08 01 i8@1 is the temperature"},
    {"u16_be@n", "unsigned 16 bit, high byte first"},
    {"u32_be@n", "unsigned 32 bit, high byte first"},
    {"bcd(b)@n", "binary coded decimal of b bytes (1 to 8), high byte first"},
    {"counts@n", "energy register N itself, 32 bit; FFFFFFFF: no value"},
    {"energy@n",
     "energy register N in kWh or kvarh: N / (2 A) * Kn * Kt; A, Kn and Kt are from the meter or "
     "the options"},
    {"voltage_be@n", "voltage in V, multiplied by Kn, in a reply to 08 11, 08 14 or 08 16"},
    {"current_be@n", "current in A, multiplied by Ci and Kt, in a reply to 08 11, 08 14 or 08 16"},
    {"power_be@n",
     "power in W, multiplied by Kc, Kn and Kt, in a reply to 08 11, 08 14 or 08 16; the sign is "
     "the "
     "active direction"},
    {"reactive_be@n",
     "power in var, multiplied by Kc, Kn and Kt, in a reply to 08 11, 08 14 or 08 16; the sign is "
     "the reactive direction"},
    {"apparent_be@n",
     "power in VA, multiplied by Kc, Kn and Kt, in a reply to 08 11, 08 14 or 08 16; no sign"},
    {"factor_be@n",
     "power factor in a reply to 08 11, 08 14 or 08 16; the sign is the active direction"},
    {"hundredths_be@n",
     "frequency or distortion, sent in hundredths without sign, in a reply to 08 11, 08 14 or 08 "
     "16"},
    {"text_cp1251(b)@n", "b bytes of Windows-1251 text"},
    {"version@n", "three BCD bytes as text: 03.09.30"},
    {"date@n", "BCD day, month, year as text: 2002-09-06"},
    {"time@n", "BCD second, minute, hour, weekday, day, month, year as text: 2002-09-02T15:30:31"},
    {"time_min@n", "BCD minute, hour, weekday, day, month, year as text: 2002-09-02T15:30"},
    {"clock@n",
     "the meter's clock (04 00, 09 00 00) as seconds since 1970 UTC; needs `time_zone` to be good"},
    {"drift@n",
     "the meter's clock (04 00, 09 00 00) minus this machine's clock, in seconds; good while this "
     "machine's clock is synchronised"},
    {"latched@n",
     "time of the broadcast (`latch`) that the meter received last (08 14 50), in seconds since "
     "1970"},
    {"flag@nn", "bit E-nn (1 to 40) of the status word, 08 0A"},
    {"alarm@n", "any bit of the status word except E-38, E-39, E-40"},
};

const DecoderRow& RowOf(Decoder decoder) { return kDecoders[static_cast<std::size_t>(decoder)]; }

const DecoderRow* FindDecoder(std::string_view name) {
  for (const DecoderRow& row : kDecoders) {
    if (row.name == name) return &row;
  }
  return nullptr;
}

Error Wrong(std::string_view read, const std::string& why) {
  return Error{"read \"" + std::string(read) + "\": " + why};
}

/// Returns how many data bytes a reply must have to contain the whole field.
std::size_t EndOf(const Field& field) {
  if (field.decoder == Decoder::flag) return (field.offset + 7) / 8;
  const std::size_t size = RowOf(field.decoder).size;
  return field.offset + (size == 0 ? field.count : size);
}

Status ParseDecoder(std::string_view read, std::string_view text, Field& field) {
  const auto at = text.find('@');
  std::string_view name = text.substr(0, at);
  const auto offset = ParseInteger<std::size_t>(text.substr(at + 1));
  if (!offset) return Wrong(read, "the offset after @ must be a number, as in float_le@0");
  std::optional<std::size_t> count;
  if (const auto open = name.find('('); open != std::string_view::npos) {
    if (name.back() != ')') return Wrong(read, "no closing parenthesis");
    count = ParseInteger<std::size_t>(name.substr(open + 1, name.size() - open - 2));
    if (!count) return Wrong(read, "the length in parentheses must be a number, as in bcd(2)@0");
    name = name.substr(0, open);
  }
  const DecoderRow* row = FindDecoder(name);
  if (row == nullptr) {
    return Wrong(read, "no decoder \"" + std::string(name) +
                           "\"; `baudgate protocols set4tm` lists the decoders");
  }
  if (count.has_value() != (row->size == 0)) {
    return Wrong(read, std::string(name) +
                           (count ? " takes no length in parentheses"
                                  : " needs its length, as in " + std::string(name) + "(2)@0"));
  }
  const std::size_t most = row->decoder == Decoder::bcd ? 8 : kMaxData;
  if (count && (*count == 0 || *count > most)) {
    return Wrong(read, "the length must be 1 to " + std::to_string(most));
  }
  if (*offset > kMaxData)
    return Wrong(read, "the offset is beyond the end of every reply; write a smaller offset");
  field.decoder = row->decoder;
  field.offset = *offset;
  field.count = count.value_or(0);
  return {};
}

Status CheckPdu(std::string_view read, const Field& field) {
  const Bytes& pdu = field.pdu;
  if (AnsweredByStatus(pdu)) {
    return Wrong(read, "only read requests are allowed (codes 04, 05, 06, 08, 09, 0A, 0C)");
  }
  if (pdu.size() >= 2 && pdu[0] == kRead && pdu[1] == kFloatMask) {
    return Wrong(read,
                 "the gateway sends 08 23 by itself; write the value as 08 1B 00 rr or 08 1B 02 rr "
                 "and set `snapshot: true`");
  }
  const bool asks_clock = pdu == Bytes{kJournal, 0} || pdu == Bytes{kJournalExtended, 0, 0};
  const bool of_clock = field.decoder == Decoder::clock || field.decoder == Decoder::drift;
  if (of_clock && (!asks_clock || field.offset != 0)) {
    const std::string name(RowOf(field.decoder).name);
    return Wrong(read, name + " reads the meter's clock; write \"04 00 " + name + "@0\"");
  }
  if (field.decoder == Decoder::latched && (pdu != AskLatchTime() || field.offset != 0)) {
    return Wrong(read, "latched reads the time of the latch; write \"08 14 50 latched@0\"");
  }
  const auto length = LengthOfData(pdu);
  if (!length)
    return Wrong(read, "no reply to this request is documented; check the length of the request");
  if (field.decoder == Decoder::flag && (field.offset < 1 || field.offset > 40)) {
    return Wrong(read, "flag@nn takes 1 to 40, for E-01 to E-40");
  }
  if (EndOf(field) > *length) {
    return Wrong(
        read, "the value ends beyond the " + std::to_string(*length) +
                  " data bytes of the reply; write a smaller offset (the first byte has offset 0)");
  }
  return {};
}

}  // namespace

Result<Field> ParseField(std::string_view read) {
  const std::string_view text = Trim(read);
  const auto space = text.rfind(' ');
  if (space == std::string_view::npos || text.find('@', space) == std::string_view::npos) {
    return Wrong(read, "write the request in hex and a decoder, as in \"08 1B 00 11 float_le@0\"");
  }
  auto pdu = ParseHex(Trim(text.substr(0, space)));
  if (!pdu || pdu->empty()) return Wrong(read, "the request must be hex bytes, as in 08 1B 00 11");
  Field field;
  field.pdu = std::move(*pdu);
  if (Status status = ParseDecoder(read, text.substr(space + 1), field); !status) {
    return Error{status.error()};
  }
  if (Status status = CheckPdu(read, field); !status) return Error{status.error()};
  return field;
}

std::string FieldText(const Field& field) {
  std::string text = ToHex(field.pdu) + " " + std::string(RowOf(field.decoder).name);
  if (field.count != 0) text += "(" + std::to_string(field.count) + ")";
  return text + "@" + std::to_string(field.offset);
}

Status CheckType(const Field& field, const config::Point& point) {
  const DecoderRow& row = RowOf(field.decoder);
  const bool text = point.type == config::Type::string;
  const bool truth = point.type == config::Type::boolean;
  if ((row.kind == ValueKind::text) != text || (row.kind == ValueKind::truth) != truth) {
    const std::string_view wants = row.kind == ValueKind::text
                                       ? "string(n)"
                                       : (row.kind == ValueKind::truth ? "bool" : "a number type");
    return Error{"decoder " + std::string(row.name) + " needs type " + std::string(wants) +
                 ", not " + std::string(Name(point.type))};
  }
  if ((point.table == config::Table::bits) && !truth) {
    return Error{"only bool points fit the bit tables; write table: input"};
  }
  return {};
}

namespace {

/// Returns the measure of a float by its parameter, the RWRI byte (reference, 9.5). Powers, losses,
/// voltages and currents are multiplied by ratios; angles, distortion, frequency and battery are
/// not.
Measure MeasureOfFloat(std::uint8_t parameter) {
  const unsigned kind = (parameter >> 2U) & 3U;
  switch (parameter >> 4U) {
    case 0x0:
    case 0xE:
      return Measure::float_power;
    case 0x1:
    case 0xA:
      return kind == 3 ? Measure::plain : Measure::float_voltage;
    case 0x2:
      return kind == 0 ? Measure::float_current : Measure::plain;
    default:
      return Measure::plain;
  }
}

}  // namespace

Measure MeasureOf(const Field& field) {
  const Bytes& pdu = field.pdu;
  const bool floats = pdu.size() == 4 && pdu[0] == kRead && pdu[1] == kFloats;
  if (floats && field.decoder == Decoder::float_le) return MeasureOfFloat(pdu[3]);
  return RowOf(field.decoder).measure;
}

config::RawNumbers NumbersOf(const Field& field) {
  using config::RawNumbers;
  switch (field.decoder) {
    case Decoder::float_le:
      return {MeasureOf(field) == Measure::plain ? RawNumbers::Kind::single : RawNumbers::Kind::any,
              {}};
    case Decoder::u8:
    case Decoder::i8:
      return RawNumbers::Bits(8, field.decoder == Decoder::i8);
    case Decoder::u16_be:
      return RawNumbers::Bits(16);
    case Decoder::u32_be:
    case Decoder::counts:
      return RawNumbers::Bits(32);
    case Decoder::bcd:
      return RawNumbers::Whole(
          0, Decimal(1).Shifted(2 * static_cast<int>(field.count)).ToUint64().value_or(1) - 1);
    case Decoder::flag:
    case Decoder::alarm:
      return RawNumbers::Bits(1);
    default:
      return {};
  }
}

bool IsFlag(const Field& field) {
  return field.decoder == Decoder::flag || field.decoder == Decoder::alarm;
}

std::span<const DecoderSpec> DecoderSpecs() {
  static_assert(std::size(kSpecs) == std::size(kDecoders));
  return kSpecs;
}

namespace {

constexpr const char* kCorrectionTypes =
    "write \"03 0B\" needs type: bool to correct the clock by its drift, or a number type for "
    "seconds";

}  // namespace

Status CheckPoint(const config::Point& point) {
  for (const std::string& text : {point.read, point.write}) {
    if (const Status status = RefuseLeadingZeros(text, "@("); !status) return status;
  }
  if (point.write == kCorrectsClock && point.access == config::Access::write) {
    return point.type == config::Type::string ? Status(Error{kCorrectionTypes}) : Status();
  }
  if (point.access != config::Access::read || !point.write.empty()) {
    return Error{
        "SET-4TM points can only be read; the only writable point corrects the clock, with write: "
        "\"03 0B\" and access: w"};
  }
  const auto field = ParseField(point.read);
  if (!field) return Error{field.error()};
  return CheckType(*field, point);
}

}  // namespace baudgate::protocols::set4tm
