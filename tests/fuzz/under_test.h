// The protocol that a target fuzzes, and many combinations of its options.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/options.h"
#include "protocols/protocol.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {

const protocols::Protocol& UnderTest();

enum class Protocols {
  all,
  /// Only protocols that have a conversation of their own. Example: not modbus_ascii, which uses
  /// the conversation of modbus_rtu.
  with_conversations,
};

/// Registers a target for each protocol. Example: "rule_" and "_reply" give "rule_dcon_reply".
class RegisteredFor {
 public:
  RegisteredFor(Protocols which, const std::string& before, const std::string& behind,
                void (*run)(View input));
};

config::Options OptionsOf(const protocols::Protocol& protocol, std::uint8_t variant);

const protocols::ParsedOptions& CachedOptions(std::uint8_t variant);

}  // namespace baudgate::fuzz
