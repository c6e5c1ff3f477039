// The particulars of a protocol that other parts need and must not know by its name, such as
// gateway/outputs/status. The plugin sets them (Protocol::traits), and the configuration hands them
// on.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

namespace baudgate::config {

class Options;
struct Point;

struct Traits {
  /// What the server at the other end of a connection speaks: "Modbus TCP". Empty: the protocol is
  /// spoken on serial lines.
  std::string_view service{};
  /// The protocol for the same devices at the other kind of port. "modbus_tcp" of modbus_rtu: a
  /// Modbus gateway may be in place of a plain serial server. "modbus_rtu" of modbus_tcp: the
  /// reverse. Empty: there is none.
  std::string_view counterpart{};
  /// A request asks for several points, and the user can set how many (`block`, `max_items`).
  bool has_blocks = false;
  /// The address to which every device answers. Empty: there is none.
  std::string_view common_address{};
  /// Its replies are lines of text.
  bool speaks_text = false;
  /// The option `order` of a device says in which order the bytes of its numbers come.
  bool has_byte_order = false;
  /// A device may answer some requests only in a mode that is set at the device itself, such as
  /// remote control.
  bool has_modes = false;

  /// Replies that consist of registers. Something else proves that each came whole, so one of
  /// another length answers a request for more or fewer of them.
  struct RegisterReply {
    std::size_t around = 0;  ///< characters that belong to no register
    std::size_t each = 0;    ///< characters of one register; 0: its replies have none
  };
  RegisterReply register_reply{};

  /// Whether replies to a device with these options have no check value, so that a damaged one may
  /// look whole. Null: they have one.
  bool (*is_unchecked)(const Options& options) = nullptr;
  /// Characters that no reply without a check value has inside: one that has is damaged.
  std::string_view never_in_reply{};

  /// Whether a user sets this point at the device itself, so that it is one of its settings. Null:
  /// no point is.
  bool (*is_setting)(const Point& point) = nullptr;
  /// `read` of the point in which the device says what it is. Empty: there is none.
  std::string_view designation{};
};

/// The traits of a protocol that sets none.
inline constexpr Traits kNoTraits;

}  // namespace baudgate::config
