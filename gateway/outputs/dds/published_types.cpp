// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/published_types.h"

#include <bit>

namespace baudgate::dds {
namespace {

bool Fits(const std::string& text, std::size_t bound) {
  return text.size() <= bound && text.find('\0') == std::string::npos;
}

template <typename Sample>
bool InBounds(const Sample& sample) {
  bool fits = true;
  ForEachField<Sample>([&]<typename Value>(const Field<Sample, Value>& field) {
    if constexpr (std::is_same_v<Value, std::string>) {
      fits = fits && Fits(sample.*field.member, field.bound);
    }
  });
  return fits;
}

class Writer {
 public:
  explicit Writer(std::span<std::uint8_t> to) : to_(to) {
    for (const int byte : {0, 1, 0, 0}) PutByte(static_cast<std::uint8_t>(byte));
  }
  void Put(const std::string& text) {
    Put(static_cast<std::uint32_t>(text.size() + 1));
    for (const char c : text) PutByte(static_cast<std::uint8_t>(c));
    PutByte(0);
  }
  void Put(bool value) { PutByte(value ? 1 : 0); }
  void Put(double value) { Put(std::bit_cast<std::uint64_t>(value)); }
  template <typename T>
  requires std::is_integral_v<T>
  void Put(T value) {
    const auto bits = static_cast<std::make_unsigned_t<T>>(value);
    for (const std::size_t from = Aligned(at_, sizeof(T)); at_ < from;) PutByte(0);
    for (std::size_t i = 0; i < sizeof(T); ++i) PutByte(static_cast<std::uint8_t>(bits >> (8 * i)));
  }
  /// Returns the number of bytes that were written; 0: the buffer was too small.
  std::size_t size() const { return at_ <= to_.size() ? at_ : 0; }

 private:
  void PutByte(std::uint8_t byte) {
    if (at_ < to_.size()) to_[at_] = byte;
    ++at_;
  }

  std::span<std::uint8_t> to_;
  std::size_t at_ = 0;
};

class Reader {
 public:
  explicit Reader(View bytes) : bytes_(bytes), good_(bytes.size() >= kCdrHead) {
    // Only CDR_BE and CDR_LE are accepted, because the types of gateway/outputs/dds/baudgate.idl
    // are never sent as parameter lists.
    good_ = good_ && bytes[0] == 0 && bytes[1] <= 1;
    little_ = good_ && bytes[1] == 1;
  }
  void Get(std::string& text) {
    std::uint32_t length = 0;
    Get(length);
    if (!good_ || length > bytes_.size() - at_) return Fail();
    text.assign(AsText(bytes_.subspan(at_, length)));
    if (!text.empty() && text.back() == '\0') text.pop_back();
    at_ += length;
  }
  void Get(double& value) {
    std::uint64_t bits = 0;
    Get(bits);
    value = std::bit_cast<double>(bits);
  }
  void Get(bool& value) {
    std::uint8_t byte = 0;
    Get(byte);
    if (byte > 1) return Fail();
    value = byte == 1;
  }
  template <typename T>
  requires std::is_integral_v<T>
  void Get(T& value) {
    const std::size_t from = Aligned(at_, sizeof(T));
    if (!good_ || from > bytes_.size() || sizeof(T) > bytes_.size() - from) return Fail();
    std::make_unsigned_t<T> bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      const std::uint64_t byte = bytes_[from + i];
      bits = static_cast<decltype(bits)>(bits | byte << (8 * (little_ ? i : sizeof(T) - 1 - i)));
    }
    value = static_cast<T>(bits);
    at_ = from + sizeof(T);
  }
  bool good() const { return good_; }

 private:
  void Fail() { good_ = false; }

  View bytes_;
  std::size_t at_ = kCdrHead;
  bool good_ = false;
  bool little_ = false;
};

}  // namespace

template <typename Sample>
std::size_t Encode(const Sample& sample, std::span<std::uint8_t> to) {
  if (!InBounds(sample)) return 0;
  Writer writer(to);
  ForEachField<Sample>([&](const auto& field) { writer.Put(sample.*field.member); });
  return writer.size();
}

template <typename Sample>
bool Decode(View bytes, Sample& sample) {
  Reader reader(bytes);
  ForEachField<Sample>([&](const auto& field) { reader.Get(sample.*field.member); });
  return reader.good() && InBounds(sample);
}

template std::size_t Encode(const PointSample& sample, std::span<std::uint8_t> to);
template std::size_t Encode(const DeviceSample& sample, std::span<std::uint8_t> to);
template std::size_t Encode(const GatewaySample& sample, std::span<std::uint8_t> to);
template std::size_t Encode(const EventSample& sample, std::span<std::uint8_t> to);
template std::size_t Encode(const AlarmSample& sample, std::span<std::uint8_t> to);
template std::size_t Encode(const RequestSample& sample, std::span<std::uint8_t> to);
template std::size_t Encode(const ReplySample& sample, std::span<std::uint8_t> to);
template bool Decode(View bytes, PointSample& sample);
template bool Decode(View bytes, DeviceSample& sample);
template bool Decode(View bytes, GatewaySample& sample);
template bool Decode(View bytes, EventSample& sample);
template bool Decode(View bytes, AlarmSample& sample);
template bool Decode(View bytes, RequestSample& sample);
template bool Decode(View bytes, ReplySample& sample);

namespace {

constexpr std::string_view kHead =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<!-- The types of baudgate.idl as DDS-XML.
     SPDX-License-Identifier: Apache-2.0 -->
<dds xmlns="http://www.omg.org/dds">
  <types>
    <module name="baudgate">
      <module name="v1">
)";
constexpr std::string_view kFoot =
    R"(      </module>
    </module>
  </types>
</dds>
)";

std::string_view XmlName(TypeField::Kind kind) {
  switch (kind) {
    case TypeField::Kind::text:
      return "string";
    case TypeField::Kind::boolean:
      return "boolean";
    case TypeField::Kind::float64:
      return "float64";
    case TypeField::Kind::uint16:
      return "uint16";
    case TypeField::Kind::uint32:
      return "uint32";
    case TypeField::Kind::int64:
      return "int64";
    case TypeField::Kind::uint64:
      return "uint64";
  }
  return "";
}

std::string Attribute(std::string_view name, std::string_view value) {
  return " " + std::string(name) + "=\"" + std::string(value) + "\"";
}

std::string Struct(const TypeDescription& type) {
  const std::string indent(8, ' ');
  std::string xml = indent + "<struct" + Attribute("name", type.name) +
                    Attribute("extensibility", "final") + ">\n";
  for (const TypeField& field : type.fields) {
    xml += indent + "  <member" + Attribute("name", field.name) +
           Attribute("type", XmlName(field.kind));
    if (field.bound > 0) xml += Attribute("stringMaxLength", std::to_string(field.bound));
    if (field.key) xml += Attribute("key", "true");
    xml += "/>\n";
  }
  return xml + indent + "</struct>\n";
}

}  // namespace

std::string TypesXml() {
  std::string xml(kHead);
  ForEachType([&xml](const TypeDescription& type) { xml += Struct(type); });
  xml += kFoot;
  return xml;
}

}  // namespace baudgate::dds
