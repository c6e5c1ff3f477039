// The protocol that a target fuzzes, with its options in many combinations.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/options.h"
#include "protocols/protocol.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {

/// The protocol of the target that runs.
const protocols::Protocol& UnderTest();

enum class Protocols {
  all,
  with_conversations,  ///< those of modbus_ascii are the conversations of modbus_rtu
};

/// Registers a target for each protocol, with the protocol's name between `before` and `behind`.
class RegisteredFor {
 public:
  RegisteredFor(Protocols which, const std::string& before, const std::string& behind,
                void (*run)(View input));
};

/// The device options with flags and choices set by the bits of `variant`.
config::Options OptionsOf(const protocols::Protocol& protocol, std::uint8_t variant);

/// Kept for ever, made on first use.
const protocols::ParsedOptions& CachedOptions(std::uint8_t variant);

}  // namespace baudgate::fuzz
