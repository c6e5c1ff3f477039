// The wire form of the samples (XCDR1, as any vendor's compiler makes it from baudgate.idl), both
// ways. Bytes come from and go to Fast DDS payloads (gateway/outputs/dds/fast/types.cpp).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "gateway/base/bytes.h"
#include "gateway/outputs/dds/type_fields.h"

namespace baudgate::dds {

/// Representation identifier (CDR_BE 00 00, CDR_LE 00 01) and two bytes of options.
inline constexpr std::size_t kCdrHead = 4;

/// A number stands at a multiple of its size, counted from the end of the encapsulation.
constexpr std::size_t Aligned(std::size_t at, std::size_t size) {
  return kCdrHead + (at - kCdrHead + size - 1) / size * size;
}

/// The end of a sample whose texts are as long as their bounds: no sample is longer.
template <typename Sample>
constexpr std::size_t LongestSample() {
  std::size_t at = kCdrHead;
  ForEachField<Sample>([&at]<typename Value>(const Field<Sample, Value>& field) {
    if constexpr (std::is_same_v<Value, std::string>) {
      at = Aligned(at, sizeof(std::uint32_t)) + sizeof(std::uint32_t) + field.bound + 1;
    } else {
      at = Aligned(at, sizeof(Value)) + sizeof(Value);
    }
  });
  return at;
}
template <typename Sample>
inline constexpr std::size_t kMaxBytes = LongestSample<Sample>();

/// For the samples in type_fields.h. Writes little-endian CDR with its encapsulation header;
/// returns the bytes used, or 0 when a text is beyond its bound or `to` is too small.
template <typename Sample>
std::size_t Encode(const Sample& sample, std::span<std::uint8_t> to);

/// For the samples in type_fields.h. Reads either byte order. False on anything but a whole sample
/// within its bounds; never throws, whatever the bytes. `sample` is then unspecified.
template <typename Sample>
bool Decode(View bytes, Sample& sample);

}  // namespace baudgate::dds
