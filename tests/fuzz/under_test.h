// The protocol that this binary fuzzes (tests/fuzz/CMakeLists.txt names it), with its options in
// many combinations.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/options.h"
#include "protocols/protocol.h"

namespace baudgate::fuzz {

const Protocol& UnderTest();

/// The device options with flags and choices set by the bits of `variant`.
config::Options OptionsOf(const Protocol& protocol, std::uint8_t variant);

/// Kept for ever, made on first use.
const config::Options& CachedOptions(std::uint8_t variant);

}  // namespace baudgate::fuzz
