// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/cdr.h"

#include <fastcdr/Cdr.h>

#include <exception>

namespace baudgate::dds {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

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

template <typename Sample>
std::size_t EncodeAny(const Sample& sample, std::span<std::uint8_t> to) {
  if (!InBounds(sample)) return 0;
  try {
    FastBuffer buffer(reinterpret_cast<char*>(to.data()), to.size());
    Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
    cdr.serialize_encapsulation();
    ForEachField(sample, [&cdr](const auto& field) { cdr << field; });
    return cdr.getSerializedDataLength();
  } catch (const std::exception&) {
    return 0;
  }
}

template <typename Sample>
bool DecodeAny(View bytes, Sample& sample) {
  // CDR_BE 00 00 and CDR_LE 00 01 only; what else fastcdr knows (parameter lists) is not ours.
  if (bytes.size() < 4 || bytes[0] != 0 || bytes[1] > 1) return false;
  try {
    // fastcdr takes no const buffer; reading leaves it alone.
    auto* data = reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data()));
    FastBuffer buffer(data, bytes.size());
    Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    ForEachField(sample, [&cdr](auto& field) { cdr >> field; });
    return InBounds(sample);
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace

std::size_t Encode(const PointSample& sample, std::span<std::uint8_t> to) {
  return EncodeAny(sample, to);
}
std::size_t Encode(const DeviceSample& sample, std::span<std::uint8_t> to) {
  return EncodeAny(sample, to);
}
bool Decode(View bytes, PointSample& sample) { return DecodeAny(bytes, sample); }
bool Decode(View bytes, DeviceSample& sample) { return DecodeAny(bytes, sample); }

}  // namespace baudgate::dds
