// Values are not encoded with libmodbus, because the float functions of Debian's version are wrong.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/register_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "gateway/outputs/modbus/registers/register_contents.h"

namespace baudgate::modbus {

namespace {

constexpr std::uint16_t kDeviceUnit = 1;  // units_[0] is unmapped; devices begin at units_[1]

bool InValueArea(const Span& span) {
  return span.count > 0 && config::IsValueArea(span.start, span.end() - 1);
}

bool StartsBelow(std::uint32_t address, const Span& span) { return address < span.start; }

/// Finds the span that contains an address. Most requests read adjacent points, so Find tries the
/// span after its last result before it searches.
class Finder {
 public:
  explicit Finder(const std::vector<Span>& spans) : spans_(spans) {}

  const Span* Find(std::uint32_t address) {
    if (next_ < spans_.size() && spans_[next_].start == address) return &spans_[next_++];
    const auto after = std::upper_bound(spans_.begin(), spans_.end(), address, StartsBelow);
    next_ = static_cast<std::size_t>(after - spans_.begin());
    if (next_ == 0) return nullptr;
    const Span& span = spans_[next_ - 1];
    return address < span.end() ? &span : nullptr;
  }

 private:
  const std::vector<Span>& spans_;
  std::size_t next_ = 0;
};

/// Adds a span. A span that overlaps an earlier span or is outside the value areas is dropped; the
/// check of the configuration should have refused it.
void Insert(std::vector<Span>& spans, const Span& span) {
  if (!InValueArea(span)) return;
  const auto after = std::upper_bound(spans.begin(), spans.end(), span.start, StartsBelow);
  if (after != spans.end() && after->start < span.end()) return;
  if (after != spans.begin() && std::prev(after)->end() > span.start) return;
  spans.insert(after, span);
}

UnitMap MapOf(const config::Device& device, std::uint32_t index) {
  UnitMap unit;
  unit.kind = UnitMap::Kind::device;
  unit.device = index;
  unit.status_layout.assign(kDeviceBlockLayout.begin(), kDeviceBlockLayout.end());
  for (std::uint32_t i = 0; i < device.points.size(); ++i) {
    const config::Point& point = device.points[i];
    if (!point.modbus) continue;
    const bool bit = point.table == config::Table::bits;
    const std::size_t count = bit ? 1 : config::RegisterCount(point);
    if (count > kValuesEnd) continue;
    Insert(bit ? unit.bits : unit.registers, {*point.modbus, static_cast<std::uint16_t>(count), i,
                                              point.access != config::Access::write});
    if (point.writing.select && point.writing.allowed) unit.selects.emplace(*point.modbus, i);
  }
  return unit;
}

class Planner {
 public:
  Planner(const UnitMap& unit, config::Table table, std::uint16_t start, std::uint16_t count,
          std::vector<Piece>& pieces)
      : unit_(unit),
        finder_(unit.spans(table)),
        table_(table),
        at_(start),
        start_(start),
        end_(static_cast<std::uint32_t>(start) + count),
        pieces_(pieces) {
    pieces_.clear();
  }

  ExceptionCode Read(Holes holes) {
    bool nothing = true;
    while (at_ < end_) {
      if (ReadStep()) {
        nothing = false;
      } else if (holes == Holes::zero) {
        AddHole();
      } else {
        return kIllegalAddress;
      }
    }
    return nothing ? kIllegalAddress : Verdict();
  }

  ExceptionCode Write() {
    while (at_ < end_) {
      const Span* span = finder_.Find(at_);
      if (span == nullptr) return kIllegalAddress;
      AddValue(*span);
    }
    return Verdict();
  }

 private:
  ExceptionCode Verdict() const { return cut_ ? kIllegalValue : kNoException; }

  bool ReadStep() {
    if (at_ >= kAgeOffset) {
      return table_ == config::Table::registers && AddMirror(Area::age, kAgeOffset);
    }
    if (at_ >= kQualityOffset) return AddMirror(Area::quality, kQualityOffset);
    if (at_ >= kEventBlock && at_ < kValuesAfterStatus) {
      return AddBlock(Area::events, kEventBlock, kEventBlockLayout);
    }
    if (at_ >= kStatusBlock && at_ < kEventBlock) {
      return AddBlock(Area::status, kStatusBlock, unit_.status_layout);
    }
    const Span* span = finder_.Find(at_);
    if (span == nullptr || !span->readable) return false;
    AddValue(*span);
    return true;
  }

  void AddValue(const Span& span) {
    if (span.start != at_ || span.end() > end_) cut_ = true;
    Add(Area::value, span.point, std::min(span.end(), end_));
  }

  bool AddMirror(Area area, std::uint32_t offset) {
    const Span* span = finder_.Find(at_ - offset);
    if (span == nullptr || !span->readable) return false;
    Add(area, span->point, std::min(span->end() + offset, end_));
    return true;
  }

  bool AddBlock(Area area, std::uint32_t start, std::span<const std::uint16_t> layout) {
    if (table_ != config::Table::registers || layout.empty()) return false;
    const std::uint32_t block_end = start + layout.back();
    if (at_ >= block_end) return false;
    const std::uint32_t stop = std::min(block_end, end_);
    const auto boundary = [&](std::uint32_t address) {
      return std::binary_search(layout.begin(), layout.end(), address - start);
    };
    if (!boundary(at_) || !boundary(stop)) cut_ = true;
    Add(area, at_ - start, stop);
    return true;
  }

  void AddHole() {
    if (!pieces_.empty() && pieces_.back().area == Area::hole) {
      ++pieces_.back().count;
      ++at_;
    } else {
      Add(Area::hole, 0, at_ + 1);
    }
  }

  void Add(Area area, std::uint32_t index, std::uint32_t stop) {
    pieces_.push_back({area, index, static_cast<std::uint16_t>(at_ - start_),
                       static_cast<std::uint16_t>(stop - at_)});
    at_ = stop;
  }

  const UnitMap& unit_;
  Finder finder_;
  config::Table table_;
  std::uint32_t at_;
  std::uint32_t start_;
  std::uint32_t end_;
  std::vector<Piece>& pieces_;
  bool cut_ = false;
};

}  // namespace

RegisterMap::RegisterMap(const config::Config& config) {
  UnitMap gateway;
  gateway.kind = UnitMap::Kind::gateway;
  gateway.status_layout.assign(kGatewayBlockLayout.begin(), kGatewayBlockLayout.end());
  units_ = {UnitMap{}};
  std::uint32_t index = 0;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (device.unit && unit_index_[*device.unit] < kDeviceUnit) {
        unit_index_[*device.unit] = static_cast<std::uint16_t>(units_.size());
        units_.push_back(MapOf(device, index));
      }
      ++index;
    }
  }
  unit_index_[0] = unit_index_[255] = static_cast<std::uint16_t>(units_.size());
  units_.push_back(std::move(gateway));
}

ExceptionCode PlanRead(const UnitMap& unit, config::Table table, std::uint16_t start,
                       std::uint16_t count, std::vector<Piece>& pieces, Holes holes) {
  return Planner(unit, table, start, count, pieces).Read(holes);
}

ExceptionCode PlanWrite(const UnitMap& unit, config::Table table, std::uint16_t start,
                        std::uint16_t count, std::vector<Piece>& pieces) {
  return Planner(unit, table, start, count, pieces).Write();
}

namespace {

using config::Type;

bool IsFloat(Type type) { return type == Type::float32 || type == Type::float64; }

std::optional<std::uint64_t> IntegerBits(const Value& value, config::IntegerRange range) {
  const auto of_signed = [&](std::int64_t held) -> std::optional<std::uint64_t> {
    if (held < range.lowest) return std::nullopt;
    if (held > 0 && static_cast<std::uint64_t>(held) > range.highest) return std::nullopt;
    return static_cast<std::uint64_t>(held);
  };
  const auto of_unsigned = [&](std::uint64_t held) -> std::optional<std::uint64_t> {
    if (held > range.highest) return std::nullopt;
    return held;
  };
  if (const auto* held = std::get_if<bool>(&value)) return *held ? 1 : 0;
  if (const auto* held = std::get_if<std::int64_t>(&value)) return of_signed(*held);
  if (const auto* held = std::get_if<std::uint64_t>(&value)) return of_unsigned(*held);
  if (const auto* held = std::get_if<double>(&value)) {
    constexpr double k2To63 = 9223372036854775808.0;
    const double rounded = std::round(*held);
    if (rounded >= -k2To63 && rounded < k2To63)
      return of_signed(static_cast<std::int64_t>(rounded));
    if (rounded >= k2To63 && rounded < 2 * k2To63) {
      return of_unsigned(static_cast<std::uint64_t>(rounded));
    }
  }
  return std::nullopt;
}

/// Returns the bits of `value` in a type that is not `string`. Nothing: the type cannot represent
/// the value.
std::optional<std::uint64_t> BitsOf(Type type, const Value& value) {
  if (!HasValue(value) || std::holds_alternative<std::string>(value)) return std::nullopt;
  if (type == Type::boolean) {
    const auto bit = EncodeBit(value);
    if (!bit) return std::nullopt;
    return *bit ? 1 : 0;
  }
  if (!IsFloat(type)) return IntegerBits(value, config::RangeOf(type));
  const auto* held = std::get_if<double>(&value);
  const double wide = held != nullptr ? *held : ToDouble(value);
  if (type == Type::float32) {
    if (std::isfinite(wide) && std::abs(wide) > std::numeric_limits<float>::max()) {
      return std::nullopt;
    }
    return std::bit_cast<std::uint32_t>(static_cast<float>(wide));
  }
  return std::bit_cast<std::uint64_t>(wide);
}

bool SwapsBytes(config::WordOrder order) {
  return order == config::WordOrder::badc || order == config::WordOrder::dcba;
}

bool SwapsWords(config::WordOrder order) {
  return order == config::WordOrder::cdab || order == config::WordOrder::dcba;
}

std::uint64_t BytesSwapped(std::uint64_t bits) {
  constexpr std::uint64_t kLow = 0x00FF00FF00FF00FF;
  return ((bits >> 8) & kLow) | ((bits & kLow) << 8);
}

void PutBits(std::uint64_t bits, config::WordOrder order, std::span<std::uint16_t> out) {
  const std::size_t count = out.size();
  if (SwapsBytes(order) && count > 1) bits = BytesSwapped(bits);
  for (std::size_t i = 0; i < count; ++i, bits >>= 16) {
    out[SwapsWords(order) ? i : count - 1 - i] = static_cast<std::uint16_t>(bits);
  }
}

std::uint64_t TakeBits(std::span<const std::uint16_t> registers, config::WordOrder order) {
  const std::size_t count = registers.size();
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < count; ++i) {
    bits = (bits << 16) | registers[SwapsWords(order) ? count - 1 - i : i];
  }
  return SwapsBytes(order) && count > 1 ? BytesSwapped(bits) : bits;
}

void PutText(std::string_view text, std::size_t length, std::span<std::uint16_t> out) {
  text = text.substr(0, length);
  const auto byte = [&](std::size_t at) -> unsigned {
    return at < text.size() ? static_cast<std::uint8_t>(text[at]) : 0U;
  };
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::uint16_t>((byte(2 * i) << 8) | byte(2 * i + 1));
  }
}

std::string TakeText(std::span<const std::uint16_t> registers, std::size_t length) {
  std::string text;
  for (const std::uint16_t word : registers) {
    text.push_back(static_cast<char>(word >> 8));
    text.push_back(static_cast<char>(word & 0xFF));
  }
  text.resize(std::min(text.size(), length));
  text.erase(text.find_last_not_of('\0') + 1);
  return text;
}

std::uint64_t NoValueBits(Type type) {
  switch (type) {
    case Type::boolean:
      return 0;
    case Type::float32:
      return std::bit_cast<std::uint32_t>(std::numeric_limits<float>::quiet_NaN());
    case Type::float64:
      return std::bit_cast<std::uint64_t>(std::numeric_limits<double>::quiet_NaN());
    case Type::int8:
    case Type::int16:
    case Type::int32:
    case Type::int64:
      return static_cast<std::uint64_t>(config::RangeOf(type).lowest);
    default:
      return config::RangeOf(type).highest;
  }
}

Shown ShowFault(const config::Point& point, bool held) {
  using Kind = config::OnFault::Kind;
  Kind kind = point.on_fault.kind;
  if (kind == Kind::automatic) kind = IsFloat(point.type) ? Kind::nan : Kind::hold;
  if (kind == Kind::value) return Shown::substitute;
  return kind == Kind::hold && held ? Shown::held : Shown::no_value;
}

/// Extends the sign of a number of at most 32 bits. Example: the int16 0xFFFE becomes -2, not
/// 65534.
std::int64_t SignExtended(std::uint64_t bits, Type type) {
  if (type == Type::int8 || type == Type::int16) return static_cast<std::int16_t>(bits);
  if (type == Type::int32) return static_cast<std::int32_t>(bits);
  return static_cast<std::int64_t>(bits);
}

std::optional<Value> FiniteOnly(double number) {
  if (!std::isfinite(number)) return std::nullopt;
  return Value(number);
}

}  // namespace

Shown Show(const config::Point& point, config::OnBad on_bad, Quality quality, bool held) {
  if (!IsBad(quality)) return held ? Shown::held : Shown::exception;
  const bool fault =
      quality == Quality::bad_configuration || quality == Quality::bad_device_failure ||
      quality == Quality::bad_sensor_failure || quality.reason == Reason::channel_disabled;
  if (fault && !ConcernsDevice(quality.reason)) {
    return ShowFault(point, held);
  }
  if (on_bad == config::OnBad::hold) return held ? Shown::held : Shown::exception;
  if (on_bad == config::OnBad::nan) {
    const bool bit = point.table == config::Table::bits;
    if (!bit && (IsFloat(point.type) || point.type == Type::string)) return Shown::no_value;
    if (point.on_fault.kind == config::OnFault::Kind::value) return Shown::substitute;
  }
  return Shown::exception;
}

bool EncodeRegisters(const config::Point& point, config::WordOrder order, const Value& value,
                     std::span<std::uint16_t> out) {
  if (point.type == Type::string) {
    if (!HasValue(value)) return false;
    if (const auto* text = std::get_if<std::string>(&value)) {
      PutText(*text, point.text_length, out);
    } else {
      PutText(ToText(value), point.text_length, out);
    }
    return true;
  }
  const auto bits = BitsOf(point.type, value);
  if (!bits) return false;
  PutBits(*bits, order, out);
  return true;
}

void EncodeNoValue(const config::Point& point, config::WordOrder order,
                   std::span<std::uint16_t> out) {
  if (point.type == Type::string) {
    PutText({}, 0, out);
  } else {
    PutBits(NoValueBits(point.type), order, out);
  }
}

std::optional<bool> EncodeBit(const Value& value) {
  if (const auto* held = std::get_if<bool>(&value)) return *held;
  const double number = ToDouble(value);
  if (std::isnan(number)) return std::nullopt;
  return number != 0;
}

std::optional<Value> DecodeRegisters(const config::Point& point, config::WordOrder order,
                                     std::span<const std::uint16_t> registers) {
  if (registers.empty() || registers.size() != config::RegisterCount(point)) return std::nullopt;
  if (point.type == Type::string) return Value(TakeText(registers, point.text_length));
  const std::uint64_t bits = TakeBits(registers, order);
  switch (point.type) {
    case Type::boolean:
      if (bits > 1) return std::nullopt;
      return Value(bits == 1);
    case Type::float32:
      return FiniteOnly(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    case Type::float64:
      return FiniteOnly(std::bit_cast<double>(bits));
    case Type::uint64:
      return Value(bits);
    default: {
      const std::int64_t number = SignExtended(bits, point.type);
      if (!config::RangeOf(point).Contains(number)) return std::nullopt;
      return Value(number);
    }
  }
}

namespace {

bool BitOf(const ModbusRequest& request, std::size_t at) {
  if (request.function == kWriteCoil) return request.data[0] == 0xFF;
  return ((request.data[at / 8] >> (at % 8)) & 1U) != 0;
}

Value BitValue(const config::Point& point, bool bit) {
  if (point.type == config::Type::boolean) return bit;
  return std::int64_t{bit ? 1 : 0};
}

}  // namespace

std::optional<std::uint32_t> SelectedPoint(const UnitMap& unit, const ModbusRequest& request) {
  if (request.table() != config::Table::registers || request.count != 1) return std::nullopt;
  if (request.start < config::kSelectOffset) return std::nullopt;
  const auto found =
      unit.selects.find(static_cast<std::uint16_t>(request.start - config::kSelectOffset));
  if (found == unit.selects.end()) return std::nullopt;
  return found->second;
}

bool IsSelectKey(const ModbusRequest& request) {
  return ByteReader(request.data).U16Be(0) == config::kSelectKey;
}

bool IsFirstEvent(const ModbusRequest& request) {
  return request.table() == config::Table::registers && request.start >= config::kEventBlock &&
         request.start + request.count <= config::kEventBlock + 2;
}

std::optional<std::uint32_t> FirstEvent(const ModbusRequest& request) {
  if (request.count != 2) return std::nullopt;
  return ByteReader(request.data).U32Be(0);
}

ConvertedWrite ConvertWrites(const UnitMap& unit, const config::Device& device,
                             const ModbusRequest& request) {
  std::vector<Piece> pieces;
  const config::Table table = request.table();
  const auto exception = PlanWrite(unit, table, request.start, request.count, pieces);
  if (exception != kNoException) return {exception};

  std::array<std::uint16_t, kMostWrittenRegisters> registers{};
  if (table == config::Table::registers) {
    const ByteReader data(request.data);
    for (std::size_t i = 0; i < request.count; ++i) registers[i] = data.U16Be(2 * i).value_or(0);
  }
  ConvertedWrite converted;
  for (const Piece& piece : pieces) {
    const config::Point& point = device.points[piece.index];
    const Value value =
        table == config::Table::bits
            ? BitValue(point, BitOf(request, piece.offset))
            : DecodeRegisters(point, device.word_order,
                              std::span(registers).subspan(piece.offset, piece.count))
                  .value_or(Value());
    if (!HasValue(value)) return {kIllegalValue};
    converted.parts.push_back({piece.index, value});
  }
  return converted;
}

}  // namespace baudgate::modbus
