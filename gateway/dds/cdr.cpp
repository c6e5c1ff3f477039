// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/cdr.h"

#include <bit>
#include <type_traits>

namespace baudgate::dds {
namespace {

bool Fits(const std::string& text, std::size_t bound) {
  return text.size() <= bound && text.find('\0') == std::string::npos;
}

bool InBounds(const PointSample& s) {
  return Fits(s.gateway, kMaxKey) && Fits(s.device, kMaxKey) && Fits(s.point, kMaxKey) &&
         Fits(s.text, kMaxText) && Fits(s.unit, kMaxUnit);
}

bool InBounds(const DeviceSample& s) {
  return Fits(s.gateway, kMaxKey) && Fits(s.device, kMaxKey) && Fits(s.line, kMaxKey);
}

bool InBounds(const GatewaySample& s) {
  return Fits(s.gateway, kMaxKey) && Fits(s.version, kMaxVersion);
}

bool InBounds(const EventSample& s) {
  return Fits(s.gateway, kMaxKey) && Fits(s.device, kMaxKey) && Fits(s.text, kMaxText);
}

bool InBounds(const AlarmSample& s) {
  return Fits(s.gateway, kMaxKey) && Fits(s.line, kMaxKey) && Fits(s.device, kMaxKey) &&
         Fits(s.name, kMaxAlarmName) && Fits(s.point, kMaxKey) && Fits(s.text, kMaxText) &&
         Fits(s.acknowledged_by, kMaxKey);
}

bool InBounds(const RequestSample& s) {
  return Fits(s.gateway, kMaxKey) && Fits(s.client, kMaxKey) && Fits(s.device, kMaxKey) &&
         Fits(s.point, kMaxKey) && Fits(s.text, kMaxText);
}

bool InBounds(const ReplySample& s) {
  return Fits(s.gateway, kMaxKey) && Fits(s.client, kMaxKey) && Fits(s.outcome, kMaxOutcome) &&
         Fits(s.reason, kMaxReason);
}

// The order of baudgate.idl, for both directions.
template <typename Sample, typename Op>
requires std::is_same_v<std::remove_const_t<Sample>, PointSample>
void ForEachField(Sample& s, Op op) {
  op(s.gateway), op(s.device), op(s.point);
  op(s.value), op(s.text), op(s.unit);
  op(s.quality), op(s.source_time_ns), op(s.seq), op(s.rtt_us);
}

template <typename Sample, typename Op>
requires std::is_same_v<std::remove_const_t<Sample>, DeviceSample>
void ForEachField(Sample& s, Op op) {
  op(s.gateway), op(s.device), op(s.line);
  op(s.state), op(s.last_outcome), op(s.last_ok_time_ns);
  op(s.exchanges), op(s.ok), op(s.no_reply), op(s.corrupt), op(s.retries);
  op(s.rtt_mean_us), op(s.rtt_p99_us);
}

template <typename Sample, typename Op>
requires std::is_same_v<std::remove_const_t<Sample>, GatewaySample>
void ForEachField(Sample& s, Op op) { op(s.gateway), op(s.start_time_ns), op(s.version); }

template <typename Sample, typename Op>
requires std::is_same_v<std::remove_const_t<Sample>, EventSample>
void ForEachField(Sample& s, Op op) {
  op(s.gateway), op(s.device), op(s.seq);
  op(s.device_time_ns), op(s.receive_time_ns);
  op(s.clock_quality), op(s.channel), op(s.code), op(s.text);
}

template <typename Sample, typename Op>
requires std::is_same_v<std::remove_const_t<Sample>, AlarmSample>
void ForEachField(Sample& s, Op op) {
  op(s.gateway), op(s.line), op(s.device), op(s.name);
  op(s.point), op(s.state), op(s.priority), op(s.seq);
  op(s.raised_time_ns), op(s.changed_time_ns), op(s.text), op(s.acknowledged_by);
}

template <typename Sample, typename Op>
requires std::is_same_v<std::remove_const_t<Sample>, RequestSample>
void ForEachField(Sample& s, Op op) {
  op(s.gateway), op(s.client), op(s.seq);
  op(s.device), op(s.point), op(s.value), op(s.text);
  op(s.confirm), op(s.deadline_ms), op(s.not_after_ns);
}

template <typename Sample, typename Op>
requires std::is_same_v<std::remove_const_t<Sample>, ReplySample>
void ForEachField(Sample& s, Op op) {
  op(s.gateway), op(s.client), op(s.seq);
  op(s.outcome), op(s.reason), op(s.took_us);
}

// Representation identifier (CDR_BE 00 00, CDR_LE 00 01) and two bytes of options.
constexpr std::size_t kEncapsulation = 4;

/// A number stands at a multiple of its size, counted from the end of the encapsulation.
std::size_t Aligned(std::size_t at, std::size_t size) {
  return kEncapsulation + (at - kEncapsulation + size - 1) / size * size;
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
  /// Bytes used; 0: there was no room for all.
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
  explicit Reader(View bytes) : bytes_(bytes), good_(bytes.size() >= kEncapsulation) {
    // What else there is (parameter lists) is not ours.
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
  std::size_t at_ = kEncapsulation;
  bool good_ = false;
  bool little_ = false;
};

template <typename Sample>
std::size_t EncodeAny(const Sample& sample, std::span<std::uint8_t> to) {
  if (!InBounds(sample)) return 0;
  Writer writer(to);
  ForEachField(sample, [&writer](const auto& field) { writer.Put(field); });
  return writer.size();
}

template <typename Sample>
bool DecodeAny(View bytes, Sample& sample) {
  Reader reader(bytes);
  ForEachField(sample, [&reader](auto& field) { reader.Get(field); });
  return reader.good() && InBounds(sample);
}

}  // namespace

std::size_t Encode(const PointSample& sample, std::span<std::uint8_t> to) {
  return EncodeAny(sample, to);
}
std::size_t Encode(const DeviceSample& sample, std::span<std::uint8_t> to) {
  return EncodeAny(sample, to);
}
std::size_t Encode(const GatewaySample& sample, std::span<std::uint8_t> to) {
  return EncodeAny(sample, to);
}
std::size_t Encode(const EventSample& sample, std::span<std::uint8_t> to) {
  return EncodeAny(sample, to);
}
std::size_t Encode(const AlarmSample& sample, std::span<std::uint8_t> to) {
  return EncodeAny(sample, to);
}
std::size_t Encode(const RequestSample& sample, std::span<std::uint8_t> to) {
  return EncodeAny(sample, to);
}
std::size_t Encode(const ReplySample& sample, std::span<std::uint8_t> to) {
  return EncodeAny(sample, to);
}
bool Decode(View bytes, PointSample& sample) { return DecodeAny(bytes, sample); }
bool Decode(View bytes, DeviceSample& sample) { return DecodeAny(bytes, sample); }
bool Decode(View bytes, GatewaySample& sample) { return DecodeAny(bytes, sample); }
bool Decode(View bytes, EventSample& sample) { return DecodeAny(bytes, sample); }
bool Decode(View bytes, AlarmSample& sample) { return DecodeAny(bytes, sample); }
bool Decode(View bytes, RequestSample& sample) { return DecodeAny(bytes, sample); }
bool Decode(View bytes, ReplySample& sample) { return DecodeAny(bytes, sample); }

}  // namespace baudgate::dds
