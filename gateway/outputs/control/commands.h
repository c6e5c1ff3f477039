// The commands of the control socket: one row each, with its fields and the part that answers it.
// docs/status.md describes them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "gateway/outputs/control/request.h"

namespace baudgate::control {

/// Besides "command".
struct Member {
  enum class Type : std::uint8_t { text, flag, whole, two_wholes };
  std::string_view name;
  Type type = Type::text;
};

struct Command {
  std::string_view name;
  std::vector<Member> members;
  Reply (*answer)(const Gateway& gateway, const Request& request);
  bool reads_disk = false;  ///< it answers at once, and as late as the disk does
};

/// In the order in which they are listed for people.
const std::vector<Command>& Commands();

}  // namespace baudgate::control
