// The key hashes of samples, as every DDS vendor computes them from baudgate.idl.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "gateway/dds/samples.h"

namespace baudgate::dds {

/// RTPS 9.6.3.8: MD5 of the key fields in big-endian CDR, as the key may be longer than 16 bytes.
using KeyHash = std::array<std::uint8_t, 16>;
KeyHash HashKey(const PointSample& sample);
KeyHash HashKey(const DeviceSample& sample);
KeyHash HashKey(const GatewaySample& sample);
KeyHash HashKey(const EventSample& sample);
KeyHash HashKey(const AlarmSample& sample);
KeyHash HashKey(const RequestSample& sample);
KeyHash HashKey(const ReplySample& sample);

}  // namespace baudgate::dds
