// Devices made from small slices of the shipped profiles, so that conversations are built fast.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "protocols/protocol.h"
#include "tests/fuzz/fuzz.h"

namespace baudgate::fuzz {

/// Returns a device with a few points, writable if the protocol supports writing. The device is
/// created on first use and never freed. All argument values are valid.
const config::Device& DeviceOf(std::uint8_t slice, std::uint8_t variant);

void CheckAnswer(const protocols::Answer& answer, const config::Device& device);

}  // namespace baudgate::fuzz
