// The key hashes of samples, as every DDS vendor computes them from baudgate.idl.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "gateway/outputs/dds/type_fields.h"

namespace baudgate::dds {

/// RTPS 9.6.3.8: MD5 of the key fields in big-endian CDR, as the key may be longer than 16 bytes.
using KeyHash = std::array<std::uint8_t, 16>;
/// For the samples in gateway/outputs/dds/type_fields.h.
template <typename Sample>
KeyHash HashKey(const Sample& sample);

}  // namespace baudgate::dds
