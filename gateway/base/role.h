// `Role` says what a user may do, and `May` has the table of all roles. The same roles apply to the
// page, its API and the control socket (docs/users.md).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace baudgate {

/// In the order in which they count if a user of this machine has several by its groups.
enum class Role : std::uint8_t { viewer, auditor, operating, engineer };
inline constexpr std::array<std::string_view, 4> kRoleNames = {"viewer", "auditor", "operator",
                                                               "engineer"};

constexpr std::string_view Name(Role role) { return kRoleNames[static_cast<std::size_t>(role)]; }

constexpr std::optional<Role> RoleNamed(std::string_view name) {
  for (std::size_t i = 0; i < kRoleNames.size(); ++i) {
    if (kRoleNames[i] == name) return static_cast<Role>(i);
  }
  return std::nullopt;
}

/// The kinds of request that a role may or may not make.
enum class Act : std::uint8_t {
  read,       ///< values, states, events, alarms, history, traces
  operate,    ///< acknowledge, write to points, enable and disable, lend a port
  configure,  ///< reload, confirm, telegrams by hand, settings
  audit,      ///< the records of writes, and the sessions of all users
};

/// The rights of the roles:
///
///   role       read   operate   configure   audit
///   viewer     yes
///   operator   yes    yes
///   engineer   yes    yes       yes
///   auditor    yes                          yes
///
constexpr bool May(Role role, Act act) {
  switch (act) {
    case Act::read:
      return true;
    case Act::operate:
      return role == Role::operating || role == Role::engineer;
    case Act::configure:
      return role == Role::engineer;
    case Act::audit:
      return role == Role::auditor;
  }
  return false;
}

/// Returns the role that an act needs at least, for messages.
constexpr Role NeededFor(Act act) {
  switch (act) {
    case Act::read:
      return Role::viewer;
    case Act::operate:
      return Role::operating;
    case Act::configure:
      return Role::engineer;
    case Act::audit:
      break;
  }
  return Role::auditor;
}

}  // namespace baudgate
