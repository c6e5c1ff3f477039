// The wire form of the samples (XCDR1, as any vendor's compiler makes it from baudgate.idl), both
// ways. Bytes come from and go to Fast DDS payloads (gateway/dds/fast/types.cpp).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "gateway/base/bytes.h"
#include "gateway/dds/samples.h"

namespace baudgate::dds {

/// No encoded sample is longer: encapsulation, fields at their bounds, and all padding.
inline constexpr std::size_t kPointSampleMaxBytes = 4 + 424;
inline constexpr std::size_t kDeviceSampleMaxBytes = 4 + 264;
inline constexpr std::size_t kGatewaySampleMaxBytes = 4 + 120;
inline constexpr std::size_t kEventSampleMaxBytes = 4 + 309;
inline constexpr std::size_t kAlarmSampleMaxBytes = 4 + 661;
inline constexpr std::size_t kRequestSampleMaxBytes = 4 + 456;
inline constexpr std::size_t kReplySampleMaxBytes = 4 + 444;

/// Writes little-endian CDR with its encapsulation header; returns the bytes used, or 0 when a text
/// is beyond its bound or `to` is too small.
std::size_t Encode(const PointSample& sample, std::span<std::uint8_t> to);
std::size_t Encode(const DeviceSample& sample, std::span<std::uint8_t> to);
std::size_t Encode(const GatewaySample& sample, std::span<std::uint8_t> to);
std::size_t Encode(const EventSample& sample, std::span<std::uint8_t> to);
std::size_t Encode(const AlarmSample& sample, std::span<std::uint8_t> to);
std::size_t Encode(const RequestSample& sample, std::span<std::uint8_t> to);
std::size_t Encode(const ReplySample& sample, std::span<std::uint8_t> to);

/// Reads either byte order. False on anything but a whole sample within its bounds; never throws,
/// whatever the bytes. `sample` is then unspecified.
bool Decode(View bytes, PointSample& sample);
bool Decode(View bytes, DeviceSample& sample);
bool Decode(View bytes, GatewaySample& sample);
bool Decode(View bytes, EventSample& sample);
bool Decode(View bytes, AlarmSample& sample);
bool Decode(View bytes, RequestSample& sample);
bool Decode(View bytes, ReplySample& sample);

}  // namespace baudgate::dds
