// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/printed.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "gateway/base/text.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/identification.h"
#include "protocols/set4tm/meter/plan.h"
#include "protocols/set4tm/meter/points.h"
#include "protocols/set4tm/meter/values.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr std::size_t kTime = 7;
constexpr std::size_t kInteger = 3;
constexpr std::uint8_t kStatusJournal = 0x3C;

class Printed {
 public:
  Printed(View pdu, View data, const Scale& scale)
      : pdu_(pdu.begin(), pdu.end()), data_(data), scale_(scale) {}

  View data() const { return data_; }
  const Scale& scale() const { return scale_; }
  std::uint8_t at(std::size_t place) const { return place < data_.size() ? data_[place] : 0; }

  Field FieldAt(Decoder decoder, std::size_t offset, std::size_t count = 0) const {
    return {pdu_, decoder, offset, count};
  }
  /// Adds the value that a point with this decoder would read. Its label is the `read` text of the
  /// point.
  void Add(Decoder decoder, std::size_t offset, std::size_t count = 0) {
    const Field field = FieldAt(decoder, offset, count);
    AddDecoded(FieldText(field), DecodeField(field, data_, scale_));
  }
  void AddDecoded(std::string label, Decoded decoded) {
    readings_.push_back({kNoPoint, std::move(decoded.value), decoded.quality, std::move(label)});
  }
  /// Adds a value that no decoder of points reads. Its label is the PDU and `what`.
  void AddNamed(std::string_view what, Value value, Quality quality = Quality::good) {
    readings_.push_back(
        {kNoPoint, std::move(value), quality, ToHex(pdu_) + " " + std::string(what)});
  }
  void AddAll(Decoder decoder, std::size_t from, std::size_t step) {
    for (std::size_t offset = from; offset + step <= data_.size(); offset += step) {
      Add(decoder, offset);
    }
  }
  void AddBytes(std::string_view what, std::size_t from) {
    AddNamed(what, ToHex(data_.subspan(std::min(from, data_.size()))));
  }
  std::vector<Reading> Take() { return std::move(readings_); }

 private:
  Bytes pdu_;
  View data_;
  const Scale& scale_;
  std::vector<Reading> readings_;
};

std::string DirectionOf(std::uint8_t first) {
  return std::string("active ") + ((first & 0x80U) != 0 ? "reverse" : "forward") + ", reactive " +
         ((first & 0x40U) != 0 ? "reverse" : "forward");
}

/// Adds an integer and its direction. The integer is shown as primary value if the ratios are
/// known, as secondary value if only the ratios are missing, else as count.
void AddInteger(Printed& printed, std::uint8_t parameter, std::size_t offset) {
  const Field field = printed.FieldAt(IntegerDecoder(parameter), offset);
  const std::string place = "@" + std::to_string(offset);
  Scale secondary = printed.scale();
  secondary.voltage_ratio = secondary.current_ratio = 1;
  if (FactorOf(MeasureOf(field), printed.scale())) {
    printed.Add(field.decoder, offset);
  } else if (FactorOf(MeasureOf(field), secondary)) {
    printed.AddDecoded(FieldText(field) + " secondary",
                       DecodeField(field, printed.data(), secondary));
  } else {
    const std::uint64_t count = std::uint64_t{printed.at(offset) & 0x3FU} << 16U |
                                std::uint64_t{printed.at(offset + 1)} << 8U |
                                printed.at(offset + 2);
    printed.AddNamed("count" + place, count);
  }
  printed.AddNamed("direction" + place, DirectionOf(printed.at(offset)));
}

void AddIntegers(Printed& printed, std::uint8_t parameter) {
  for (std::size_t at = 0; at + kInteger <= printed.data().size(); at += kInteger) {
    AddInteger(printed, parameter, at);
  }
}

constexpr std::string_view kFlags = "flags, as .02M and .03M number them";

void AddJournal(Printed& printed, std::uint8_t journal) {
  const View data = printed.data();
  if (journal == 0 && data.size() == kTime + 1) {
    printed.Add(Decoder::time, 0);
    printed.AddNamed("season", std::string(data[kTime] == 0 ? "summer" : "winter"));
    return;
  }
  if (journal == kStatusJournal && data.size() == 2 * kTime) {
    printed.Add(Decoder::time, 0);
    printed.AddNamed(kFlags, FlagsOf(data.subspan(kTime + 2)));
    return;
  }
  bool times = data.size() % kTime == 0;
  for (std::size_t at = 0; times && at < data.size(); at += kTime) {
    times = DecodeField(printed.FieldAt(Decoder::time, at), data, printed.scale()).quality ==
            Quality::good;
  }
  if (times) {
    printed.AddAll(Decoder::time, 0, kTime);
  } else {
    printed.AddBytes("record", 0);
  }
}

/// Converts BCD minute, hour, day, month, year to a text such as "2002-08-14T14:00".
Decoded DecodeMoment(std::uint8_t minute, View hour_and_date) {
  Bytes bytes = {minute, hour_and_date[0], 0x01};
  Append(bytes, hour_and_date.subspan(1, 3));
  return DecodeField({{}, Decoder::time_min, 0, 0}, bytes, {});
}

/// Adds memory bytes. If they begin with a load profile header whose sum is right, its hour with
/// date and its minutes of a slice are added, too.
void AddMemory(Printed& printed, std::uint8_t memory, std::size_t from) {
  const View data = printed.data().subspan(std::min(from, printed.data().size()));
  const bool profile = memory == 0x03 || memory == 0x08 || memory == 0x09;
  if (profile && data.size() >= 7) {
    const auto sum = std::accumulate(data.begin(), data.begin() + 6, 0U) & 0xFFU;
    const Decoded begin = DecodeMoment(0, data);
    if (sum == data[6] && begin.quality == Quality::good) {
      printed.AddNamed("hour of the profile", begin.value);
      printed.AddNamed("minutes of a slice", std::uint64_t{data[5]});
    }
  }
  printed.AddBytes("memory", from);
}

void AddVariant(Printed& printed) {
  constexpr std::array<double, 4> kClasses = {0.2, 0.5, 1.0, 2.0};
  const unsigned first = printed.at(0);
  const auto code = static_cast<std::uint8_t>(printed.at(2) >> 4U);
  const MeterType* type = FindType(code);
  printed.AddNamed("type",
                   type != nullptr ? std::string(type->name) : "type " + std::to_string(code));
  if (const auto constant = ParseVariant(printed.data()).meter_constant) {
    printed.AddNamed("meter constant", *constant);
  }
  printed.AddNamed("class of active energy", kClasses[first >> 6U]);
  printed.AddNamed("class of reactive energy", kClasses[(first >> 4U) & 3U]);
  const unsigned voltage = (first >> 2U) & 3U;
  const unsigned current = first & 3U;
  if (voltage < 2) {
    printed.AddNamed("nominal voltage", std::string(voltage == 0 ? "57.7 V" : "120 to 230 V"));
  }
  if (current < 3) {
    constexpr std::string_view kCurrents[] = {"5 A", "1 A", "10 A"};
    printed.AddNamed("nominal current", std::string(kCurrents[current]));
  }
}

/// Adds the parts of a pointer: minute (bit 7: wrapped), hour, day, month, year, address of the
/// next slice.
void AddPointer(Printed& printed) {
  const Decoded moment = DecodeMoment(printed.at(0) & 0x7FU, printed.data().subspan(1));
  printed.AddNamed("current slice", moment.value, moment.quality);
  printed.AddNamed("memory has wrapped", (printed.at(0) & 0x80U) != 0);
  printed.Add(Decoder::u16_be, 5);
}

void AddMasked(Printed& printed, View pdu) {
  constexpr unsigned kTimeBit = 63;
  std::size_t at = 1;
  for (const unsigned bit : MaskBits(pdu)) {
    const auto parameter = MaskedParameter(bit);
    if (bit == kTimeBit) {
      printed.Add(Decoder::time, at);
      continue;
    }
    const Field here = printed.FieldAt(Decoder::float_le, at);
    const Field own = {{kRead, kFloats, pdu[3], parameter.value_or(0)}, Decoder::float_le, 0, 0};
    printed.AddDecoded(FieldText(parameter ? own : here),
                       DecodeField(here, printed.data(), printed.scale()));
    at += 4;
  }
}

void AddLatched(Printed& printed, std::uint8_t parameter) {
  switch (printed.data().size()) {
    case 16:
      return printed.AddAll(Decoder::counts, 0, 4);
    case kTime:
      return printed.Add(Decoder::time, 0);
    default:
      return AddIntegers(printed, parameter);
  }
}

void AddTask(Printed& printed) {
  printed.Add(Decoder::u8, 0);
  if (printed.data().size() == 5) {
    printed.Add(Decoder::u8, 1);
    printed.Add(Decoder::u8, 2);
    printed.Add(Decoder::u16_be, 3);
  } else {
    printed.AddBytes("state", 1);
  }
}

void AddParameter(Printed& printed, View pdu) {
  const std::uint8_t third = pdu.size() > 2 ? pdu[2] : 0;
  switch (pdu[1]) {
    case kSerialNumber:
      printed.Add(Decoder::u32_be, 0);
      return printed.Add(Decoder::date, 4);
    case 0x01:
      return printed.Add(Decoder::i8, 1);
    case kRatios:
      printed.Add(Decoder::u16_be, 0);
      printed.Add(Decoder::u16_be, 2);
      return printed.Add(Decoder::u8, 4);
    case 0x03:
      return printed.Add(Decoder::version, 0);
    case 0x04:
      return AddPointer(printed);
    case kShortAddress:
      return printed.data().size() == 4 ? printed.Add(Decoder::u32_be, 0)
                                        : printed.Add(Decoder::u8, 1);
    case 0x06:
      return printed.Add(Decoder::u8, 1);
    case 0x09:
      return printed.Add(Decoder::u16_be, 0);
    case 0x0A:
      if (pdu.size() > 2) return printed.AddBytes("flags", 0);
      return printed.AddNamed(kFlags, FlagsOf(printed.data()));
    case 0x0B:
    case 0x24:
      return printed.Add(Decoder::text_cp1251, 0, printed.data().size());
    case 0x0C:
      return printed.AddAll(Decoder::u16_be, 0, 2);
    case 0x0D:
      return printed.AddAll(Decoder::counts, 0, 4);
    case 0x0E:
      printed.Add(Decoder::time_min, 0);
      return printed.AddNamed("tariff", std::uint64_t{printed.at(6)} + 1);
    case 0x11:
    case 0x16:
      return AddIntegers(printed, third);
    case kVariant:
      return AddVariant(printed);
    case 0x14:
      return AddLatched(printed, third);
    case 0x17:
      printed.Add(Decoder::u8, 0);
      return printed.Add(Decoder::u8, 1);
    case 0x18:
      return AddTask(printed);
    case 0x19:
      return printed.Add(Decoder::time, 0);
    case kFloats:
      return printed.AddAll(Decoder::float_le, 0, 4);
    case kFloatMask:
      return AddMasked(printed, pdu);
    default:
      return printed.AddBytes("data", 0);
  }
}

}  // namespace

std::string FlagsOf(View word) {
  std::string text;
  for (std::size_t bit = 0; bit < word.size() * 8; ++bit) {
    if (((word[bit / 8] >> (bit % 8)) & 1U) == 0) continue;
    const std::string number = std::to_string(bit + 1);
    text += (text.empty() ? "E-" : " E-") + std::string(bit < 9 ? "0" : "") + number;
  }
  return text.empty() ? "none" : text;
}

std::vector<Reading> ReadPrinted(View pdu, View data, const Scale& scale) {
  Printed printed(pdu, data, scale);
  const auto length = LengthOfData(pdu);
  const unsigned code = pdu[0];
  if (code == kJournal || code == kJournalExtended) {
    const std::uint8_t which = pdu.size() > 1 ? pdu[1] : 0xFF;
    AddJournal(printed, code == kJournal ? static_cast<std::uint8_t>(which >> 4U) : which);
  } else if (!length) {
    printed.AddBytes("data", 0);
  } else if (code == kMemory) {
    AddMemory(printed, pdu[1], 0);
  } else if (code == kMemoryTagged) {
    AddMemory(printed, pdu[2], *length == data.size() ? 1 : 3);
  } else if (code == kRead) {
    AddParameter(printed, pdu);
  } else {
    printed.AddAll(Decoder::counts, 0, 4);
  }
  return printed.Take();
}

bool MayAnswer(View pdu, std::size_t length) {
  const auto known = LengthOfData(pdu);
  if (!known || *known == length) return true;
  // SET-4TM.03 sends two more bytes after the id.
  if (pdu[0] == kMemoryTagged) return length == *known + 2;
  if (pdu[0] != kRead || pdu.size() != 2) return false;
  if (pdu[1] == 0x0A) return length == 4;        // SET-4TM.01
  return pdu[1] == 0x19 && length == kTime + 1;  // SET-4TM.02
}

}  // namespace baudgate::protocols::set4tm
