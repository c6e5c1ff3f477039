// Devices of the shipped profiles, in small slices so that a conversation is made quickly, and
// checks of what conversations answer about them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "protocols/protocol.h"
#include "tests/fuzz/fuzz.h"

namespace baudgate::fuzz {

/// A few points of a profile of the protocol under test, writable wherever the plugin allows it.
/// Kept for ever, made on first use; any number is a device.
const config::Device& DeviceOf(std::uint8_t slice, std::uint8_t variant);

/// The contract of Answer.
void CheckAnswer(const protocols::Answer& answer, const config::Device& device);

}  // namespace baudgate::fuzz
