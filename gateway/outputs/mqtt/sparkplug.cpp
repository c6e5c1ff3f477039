// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/sparkplug.h"

#include <bit>
#include <cmath>
#include <limits>

namespace baudgate::mqtt::sparkplug {
namespace {

// The numbers of the fields (sparkplug_b.proto, 6.4.1).
enum PayloadField : std::uint32_t { kPayloadTimestamp = 1, kMetrics = 2, kSeq = 3 };
enum MetricField : std::uint32_t {
  kName = 1,
  kAlias = 2,
  kTimestamp = 3,
  kType = 4,
  kHistorical = 5,
  kNull = 7,
  kProperties = 9,
  kInt = 10,
  kLong = 11,
  kFloat = 12,
  kDouble = 13,
  kBoolean = 14,
  kString = 15,
};
enum PropertyField : std::uint32_t { kKeys = 1, kValues = 2, kPropertyType = 1, kPropertyInt = 3 };

/// The kinds of fields of Protocol Buffers.
enum Kind : std::uint32_t { kVarint = 0, kFixed64 = 1, kLength = 2, kFixed32 = 5 };

void AddVarint(std::string& out, std::uint64_t value) {
  while (value >= 0x80U) {
    out += static_cast<char>((value & 0x7FU) | 0x80U);
    value >>= 7U;
  }
  out += static_cast<char>(value);
}
void AddKey(std::string& out, std::uint32_t field, Kind kind) {
  AddVarint(out, field << 3U | kind);
}
void AddNumber(std::string& out, std::uint32_t field, std::uint64_t value) {
  AddKey(out, field, kVarint);
  AddVarint(out, value);
}
void AddText(std::string& out, std::uint32_t field, std::string_view text) {
  AddKey(out, field, kLength);
  AddVarint(out, text.size());
  out += text;
}
template <typename Bits>
void AddFixed(std::string& out, std::uint32_t field, Kind kind, Bits bits) {
  AddKey(out, field, kind);
  for (std::size_t i = 0; i < sizeof(bits); ++i) out += static_cast<char>(bits >> (8 * i) & 0xFFU);
}

std::uint64_t BitsOf(const Value& value) {
  if (const auto* counter = std::get_if<std::uint64_t>(&value)) return *counter;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    return static_cast<std::uint64_t>(*whole);
  }
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(ToDouble(value)));
}

void AddValue(const Metric& metric, std::string& out) {
  switch (metric.type) {
    case DataType::boolean:
      return AddNumber(out, kBoolean, ToDouble(metric.value) != 0 ? 1 : 0);
    case DataType::float32:
      return AddFixed(out, kFloat, kFixed32,
                      std::bit_cast<std::uint32_t>(static_cast<float>(ToDouble(metric.value))));
    case DataType::float64:
      return AddFixed(out, kDouble, kFixed64, std::bit_cast<std::uint64_t>(ToDouble(metric.value)));
    case DataType::string:
      return AddText(out, kString, ToText(metric.value));
    case DataType::int64:
    case DataType::uint64:
      return AddNumber(out, kLong, BitsOf(metric.value));
    default:
      return AddNumber(out, kInt, static_cast<std::uint32_t>(BitsOf(metric.value)));
  }
}

bool HasNumber(const Value& value) {
  const auto* number = std::get_if<double>(&value);
  return HasValue(value) && (number == nullptr || std::isfinite(*number));
}

std::string EncodeMetric(const Metric& metric) {
  std::string out;
  if (!metric.name.empty()) AddText(out, kName, metric.name);
  if (metric.alias) AddNumber(out, kAlias, *metric.alias);
  if (metric.timestamp) AddNumber(out, kTimestamp, *metric.timestamp);
  AddNumber(out, kType, static_cast<std::uint32_t>(metric.type));
  if (metric.historical) AddNumber(out, kHistorical, 1);
  if (!HasNumber(metric.value)) AddNumber(out, kNull, 1);
  if (metric.quality) {
    std::string value;
    AddNumber(value, kPropertyType, static_cast<std::uint32_t>(DataType::int32));
    AddNumber(value, kPropertyInt, static_cast<std::uint32_t>(*metric.quality));
    std::string set;
    AddText(set, kKeys, "Quality");
    AddText(set, kValues, value);
    AddText(out, kProperties, set);
  }
  if (HasNumber(metric.value)) AddValue(metric, out);
  return out;
}

/// Reads the fields of a message one after the other. `bad` after damaged bytes.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  /// Goes to the next field. False: there is none.
  bool Next() {
    if (rest_.empty() || bad_) return false;
    const std::uint64_t key = Varint();
    field = static_cast<std::uint32_t>(key >> 3U);
    switch (static_cast<std::uint32_t>(key & 7U)) {
      case kVarint:
        number = Varint();
        break;
      case kFixed64:
        number = Fixed(8);
        break;
      case kFixed32:
        number = Fixed(4);
        break;
      case kLength:
        text = Take(Varint());
        break;
      default:
        bad_ = true;
    }
    return !bad_;
  }
  bool bad() const { return bad_; }

  std::uint32_t field = 0;
  std::uint64_t number = 0;
  std::string_view text{};

 private:
  std::uint64_t Varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::string_view one = Take(1);
      if (bad_) return 0;
      const auto byte = static_cast<std::uint8_t>(one.front());
      value |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
      if (byte < 0x80U) return value;
    }
    bad_ = true;
    return 0;
  }
  std::uint64_t Fixed(std::size_t size) {
    const std::string_view bytes = Take(size);
    std::uint64_t value = 0;
    for (std::size_t i = bytes.size(); i-- > 0;) {
      value = value << 8U | static_cast<std::uint8_t>(bytes[i]);
    }
    return value;
  }
  std::string_view Take(std::uint64_t size) {
    if (size > rest_.size()) {
      bad_ = true;
      rest_ = {};
      return {};
    }
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }

  std::string_view rest_;
  bool bad_ = false;
};

/// Returns a whole number with the sign that its type gives it.
Value WholeOf(DataType type, std::uint64_t bits) {
  switch (type) {
    case DataType::int8:
      return std::int64_t{static_cast<std::int8_t>(bits)};
    case DataType::int16:
      return std::int64_t{static_cast<std::int16_t>(bits)};
    case DataType::int32:
      return std::int64_t{static_cast<std::int32_t>(bits)};
    case DataType::int64:
      return static_cast<std::int64_t>(bits);
    default:
      return bits;
  }
}

bool DecodeMetric(std::string_view bytes, Metric& metric) {
  std::optional<std::uint64_t> whole;
  for (Reader reader(bytes);;) {
    if (!reader.Next()) {
      if (reader.bad()) return false;
      break;
    }
    switch (reader.field) {
      case kName:
        metric.name = reader.text;
        break;
      case kAlias:
        metric.alias = reader.number;
        break;
      case kTimestamp:
        metric.timestamp = reader.number;
        break;
      case kType:
        metric.type = static_cast<DataType>(reader.number);
        break;
      case kHistorical:
        metric.historical = reader.number != 0;
        break;
      case kInt:
      case kLong:
        whole = reader.number;
        break;
      case kFloat:
        metric.value =
            static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(reader.number)));
        break;
      case kDouble:
        metric.value = std::bit_cast<double>(reader.number);
        break;
      case kBoolean:
        metric.value = reader.number != 0;
        break;
      case kString:
        metric.value = std::string(reader.text);
        break;
      default:
        break;
    }
  }
  if (whole) metric.value = WholeOf(metric.type, *whole);
  return true;
}

}  // namespace

DataType TypeOf(const config::Point& point) {
  using config::Type;
  const bool scaled = point.scale != Decimal(1) || point.offset != Decimal(0);
  switch (point.type) {
    case Type::boolean:
      return DataType::boolean;
    case Type::string:
      return DataType::string;
    case Type::float32:
      return DataType::float32;
    case Type::float64:
      return DataType::float64;
    default:
      break;
  }
  if (scaled) return DataType::float64;
  switch (point.type) {
    case Type::int8:
      return DataType::int8;
    case Type::uint8:
      return DataType::uint8;
    case Type::int16:
      return DataType::int16;
    case Type::uint16:
      return DataType::uint16;
    case Type::int32:
      return DataType::int32;
    case Type::uint32:
      return DataType::uint32;
    case Type::int64:
      return DataType::int64;
    default:
      return DataType::uint64;
  }
}

std::string Encode(const Payload& payload) {
  std::string out;
  AddNumber(out, kPayloadTimestamp, payload.timestamp);
  for (const Metric& metric : payload.metrics) AddText(out, kMetrics, EncodeMetric(metric));
  if (payload.seq) AddNumber(out, kSeq, *payload.seq);
  return out;
}

std::optional<Payload> Decode(std::string_view bytes) {
  Payload payload;
  Reader reader(bytes);
  while (reader.Next()) {
    if (reader.field == kPayloadTimestamp) payload.timestamp = reader.number;
    if (reader.field == kSeq) payload.seq = reader.number;
    if (reader.field != kMetrics) continue;
    if (!DecodeMetric(reader.text, payload.metrics.emplace_back())) return std::nullopt;
  }
  if (reader.bad()) return std::nullopt;
  return payload;
}

}  // namespace baudgate::mqtt::sparkplug
