// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/writing.h"

#include <cmath>
#include <string>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/plan.h"
#include "protocols/modbus/values.h"

namespace baudgate::protocols::modbus {
namespace {

/// How often the register is read before a write of its bits. Equal reads show that no other master
/// is changing the register.
constexpr std::size_t kReads = 2;

bool IsBitsOfRegister(const Location& place) {
  return place.form == Form::bit || place.form == Form::bits;
}

std::string HexWord(std::uint16_t word) {
  return HexByte(static_cast<std::uint8_t>(word >> 8)) + HexByte(static_cast<std::uint8_t>(word));
}

std::uint16_t MaskOf(const Location& place) {
  return static_cast<std::uint16_t>(((1U << place.width) - 1U) << place.bit);
}

/// True if one request can write `next` directly behind `last`: neither is a bit of a register, and
/// `next` begins where `last` ends in the same table.
bool IsNext(const Location& last, const Location& next) {
  return last.table == next.table && !IsBitsOfRegister(last) && !IsBitsOfRegister(next) &&
         next.address == last.end();
}

/// Returns why a raw value does not fit the registers. If the cause is that the user's number is no
/// multiple of the point's scale, the text contains that number and its unit; otherwise it is
/// `why`.
std::string WhyNoFit(const Value& raw, const config::Point& point, const std::string& why) {
  const auto number = Decimal::Of(raw);
  if (!number || point.scale == Decimal(1) || number->IsMultipleOf(1)) return why;
  const std::string unit = point.unit.empty() ? "" : " " + point.unit;
  return (*number * point.scale + point.offset).ToText() + ": steps of " +
         Abs(point.scale).ToText() + unit;
}

}  // namespace

std::size_t Writing::Together(std::span<const PointValue> writes) const {
  std::vector<Location> places;
  for (const PointValue& write : writes) {
    const auto place = WriteLocation(device_.points[write.point]);
    if (!place) break;
    places.push_back(*place);
  }
  if (places.empty()) return 1;
  std::size_t count = 1;
  const Location& first = places.front();
  if (IsBitsOfRegister(first)) {
    unsigned taken = MaskOf(first);
    while (count < places.size() && IsBitsOfRegister(places[count]) &&
           places[count].address == first.address && (taken & MaskOf(places[count])) == 0) {
      taken |= MaskOf(places[count++]);
    }
    return count;
  }
  if (!settings_.write_together) return 1;
  const std::size_t most = IsBits(first.table) ? kMostWrittenBits : kMostWrittenRegisters;
  while (count < places.size() && IsNext(places[count - 1], places[count]) &&
         places[count].end() - first.address <= most) {
    ++count;
  }
  return count;
}

Result<std::vector<Writing::Part>> Writing::PartsOf(const Task& task) const {
  std::vector<Part> parts;
  const auto add = [&](std::size_t index, const Value& value) -> Status {
    const config::Point& point = device_.points[index];
    const auto place = WriteLocation(point);
    if (!place) return Error{"point " + point.name + ": " + place.error()};
    parts.push_back({*place, &point, value});
    return {};
  };
  if (Status status = add(task.point, task.value); !status) return Error{status.error()};
  for (const PointValue& one : task.also) {
    if (Status status = add(one.point, one.value); !status) return Error{status.error()};
  }
  return parts;
}

Result<Writing::Step> Writing::Next(const Task& task) {
  const auto parts = PartsOf(task);
  if (!parts) return Error{parts.error()};
  if (IsBitsOfRegister(parts->front().place)) {
    const auto bits = BitsOf(*parts);
    if (!bits) return Error{bits.error()};
    return StepOf(*bits);
  }
  auto pdu = IsBits(parts->front().place.table) ? CoilsPdu(*parts) : RegistersPdu(*parts);
  if (!pdu) return Error{pdu.error()};
  return Step{std::move(*pdu)};
}

Result<double> Writing::LevelOf(const Part& part) {
  const unsigned highest = (1U << part.place.width) - 1U;
  const double level = ToDouble(part.value);
  if (level >= 0 && level <= highest && level == std::floor(level)) return level;
  return Error{
      "point " + part.point->name + ": " + ToText(part.value) +
      (part.place.width == 1 ? " is neither 0 nor 1" : " is not 0..." + std::to_string(highest))};
}

Result<Writing::Bits> Writing::BitsOf(const std::vector<Part>& parts) {
  Bits bits{.address = parts.front().place.address};
  for (const Part& part : parts) {
    const auto level = LevelOf(part);
    if (!level) return Error{level.error()};
    const unsigned set = static_cast<unsigned>(*level) << part.place.bit;
    bits.mask = static_cast<std::uint16_t>(bits.mask | MaskOf(part.place));
    bits.set = static_cast<std::uint16_t>(bits.set | set);
  }
  return bits;
}

/// Returns the next request for a write of bits: a mask write. With `bits_by_read` two reads, then
/// a write of the register with the bits changed.
Writing::Step Writing::StepOf(const Bits& bits) {
  const auto keep = static_cast<std::uint16_t>(~bits.mask);
  if (!settings_.bits_by_read) return {MaskWriteRequest(bits.address, keep, bits.set)};
  if (bits != bits_) Forget();
  bits_ = bits;
  if (seen_.size() < kReads) return {ReadRequest(kReadHolding, bits.address, 1), true};
  const auto value = static_cast<std::uint16_t>((seen_.back() & keep) | bits.set);
  if (settings_.write_multiple) return {WriteRegistersRequest(bits.address, {value})};
  return {WriteRegisterRequest(bits.address, value)};
}

Status Writing::OnRead(std::uint16_t value) {
  if (!seen_.empty() && seen_.back() != value) {
    const std::string was = HexWord(seen_.back());
    Forget();
    return Error{"holding " + std::to_string(bits_.address) + " changed from " + was + " to " +
                 HexWord(value) +
                 " between two reads, so a write could overwrite its other bits; nothing was "
                 "written, so write again"};
  }
  seen_.push_back(value);
  return {};
}

Result<Bytes> Writing::CoilsPdu(const std::vector<Part>& parts) const {
  std::vector<bool> levels;
  for (const Part& part : parts) {
    const auto level = LevelOf(part);
    if (!level) return Error{level.error()};
    levels.push_back(*level == 1);
  }
  const std::uint16_t address = parts.front().place.address;
  const bool one = levels.size() == 1 && !settings_.write_multiple;
  return one ? WriteCoilRequest(address, levels.front()) : WriteCoilsRequest(address, levels);
}

Result<Bytes> Writing::RegistersPdu(const std::vector<Part>& parts) const {
  Registers all;
  for (const Part& part : parts) {
    const auto registers = Encode(part.place, part.value, settings_);
    if (!registers) {
      return Error{"point " + part.point->name + ": " +
                   WhyNoFit(part.value, *part.point, registers.error())};
    }
    all.insert(all.end(), registers->begin(), registers->end());
  }
  const std::uint16_t address = parts.front().place.address;
  const bool one = all.size() == 1 && !settings_.write_multiple;
  return one ? WriteRegisterRequest(address, all.front()) : WriteRegistersRequest(address, all);
}

namespace {

/// Returns the range that a request of function 5, 6, 15, 16, 22 or 23 writes, or nothing.
std::optional<Block<Table>> WrittenBlock(View pdu) {
  const auto word = [&](std::size_t at) {
    return static_cast<std::size_t>(pdu[at]) << 8U | pdu[at + 1];
  };
  const auto block = [](Table table, std::size_t begin, std::size_t count) {
    return Block<Table>{.key = table, .begin = begin, .end = begin + count};
  };
  if (pdu[0] == kMaskWrite && pdu.size() == 7) return block(Table::holding, word(1), 1);
  if (pdu[0] == kReadWrite && pdu.size() > 9) return block(Table::holding, word(5), word(7));
  PlainRequest plain;
  if (!IsPlainWrite(pdu[0]) || ParseRequest(pdu, plain) != kNoException) return std::nullopt;
  return block(IsAboutBits(pdu[0]) ? Table::coils : Table::holding, plain.start, plain.count);
}

}  // namespace

std::optional<std::vector<std::size_t>> ChangedPoints(View pdu, const config::Device& device) {
  std::vector<std::size_t> changed;
  if (!MayChangeSlave(pdu)) return changed;
  const auto written = WrittenBlock(pdu);
  if (!written) return std::nullopt;
  const auto covers = [&](std::size_t begin, std::size_t end) {
    return begin < written->end && written->begin < end;
  };
  const auto meets = [&](const Result<Location>& place) {
    if (!place || place->table != written->key) return false;
    return covers(place->address, place->end()) ||
           (place->scale && covers(*place->scale, *place->scale + std::size_t{1}));
  };
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const config::Point& point = device.points[i];
    const bool writes = point.access != config::Access::read;
    if (meets(ReadLocation(point)) || (writes && meets(WriteLocation(point)))) changed.push_back(i);
  }
  return changed;
}

}  // namespace baudgate::protocols::modbus
