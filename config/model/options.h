// The options of one device or line, as its protocol declares them (protocols/protocol.h).
// Description is a part of a file that only the protocol understands, and Traits are the
// particulars of a protocol that other parts need.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate::config {

/// A part of a file that only the protocol understands, as the protocol has parsed it
/// (Protocol::describe). Example: the telegrams of a device.
class Description {
 public:
  explicit Description(std::string text) : text_(std::move(text)) {}
  virtual ~Description() = default;
  Description(const Description&) = delete;
  Description& operator=(const Description&) = delete;

  /// As it was written. Two of the same text are the same.
  const std::string& text() const { return text_; }

 private:
  const std::string text_;
};

/// Null: there is none.
struct DescriptionRef {
  std::shared_ptr<const Description> what;

  bool operator==(const DescriptionRef& other) const {
    if (what == nullptr || other.what == nullptr) return what == other.what;
    return what->text() == other.what->text();
  }
};

/// Words that the user chooses, and what stands for each.
using Pairs = std::map<std::string, std::string>;

/// One option of a protocol, already of the kind that its OptionSpec demands. Durations are held in
/// nanoseconds as integers.
using OptionValue = std::variant<bool, std::int64_t, double, std::string, std::vector<std::string>,
                                 Pairs, DescriptionRef>;

/// The options of one device or line. Every option that the protocol declares is present: given by
/// the user, by the profile, or its default. The getters therefore need no fallback; asking for a
/// name that was not declared, or for another kind, is a programming error (std::bad_variant_access
/// or std::out_of_range in tests).
class Options {
 public:
  void Set(std::string name, OptionValue value) { values_[std::move(name)] = std::move(value); }
  bool Has(const std::string& name) const { return values_.contains(name); }
  bool Flag(const std::string& name) const { return std::get<bool>(values_.at(name)); }
  std::int64_t Integer(const std::string& name) const {
    return std::get<std::int64_t>(values_.at(name));
  }
  double Real(const std::string& name) const { return std::get<double>(values_.at(name)); }
  const std::string& Text(const std::string& name) const {
    return std::get<std::string>(values_.at(name));
  }
  const std::vector<std::string>& Texts(const std::string& name) const {
    return std::get<std::vector<std::string>>(values_.at(name));
  }
  const config::Pairs& Pairs(const std::string& name) const {
    return std::get<config::Pairs>(values_.at(name));
  }
  const std::shared_ptr<const Description>& Described(const std::string& name) const {
    return std::get<DescriptionRef>(values_.at(name)).what;
  }
  Duration Time(const std::string& name) const { return Duration(Integer(name)); }
  const std::map<std::string, OptionValue>& all() const { return values_; }
  bool operator==(const Options& other) const { return values_ == other.values_; }

  /// As it was written, of an option that was given and is no secret: for whoever repeats it.
  void SetWritten(std::string name, std::string text) {
    written_[std::move(name)] = std::move(text);
  }
  const std::map<std::string, std::string>& written() const { return written_; }

 private:
  std::map<std::string, OptionValue> values_;
  std::map<std::string, std::string> written_;
};

// The particulars of a protocol that other parts need and must not know by its name, such as
// gateway/outputs/status. The plugin sets them (Protocol::traits), and the configuration hands them
// on.
class Options;
struct Point;

struct Traits {
  /// The protocol of the server at the other end: "Modbus TCP". Empty: the protocol is
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
