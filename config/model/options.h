// `Options` contains the options of one device or line, as its protocol declares them
// (protocols/protocol.h). Description is a part of a file that only the protocol can parse, and
// Traits are properties of a protocol that other parts need.
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

/// A part of a file in the form that the protocol has parsed (Protocol::describe). Example: the
/// telegrams of a device.
class Description {
 public:
  explicit Description(std::string text) : text_(std::move(text)) {}
  virtual ~Description() = default;
  Description(const Description&) = delete;
  Description& operator=(const Description&) = delete;

  /// The text as written. Descriptions with equal texts are equal.
  const std::string& text() const { return text_; }

 private:
  const std::string text_;
};

/// A pointer to a Description that compares by the text; null: there is no description.
struct DescriptionRef {
  std::shared_ptr<const Description> what;

  bool operator==(const DescriptionRef& other) const {
    if (what == nullptr || other.what == nullptr) return what == other.what;
    return what->text() == other.what->text();
  }
};

using Pairs = std::map<std::string, std::string>;

/// The value of one option, of the kind that its OptionSpec requires. Durations are nanoseconds.
using OptionValue = std::variant<bool, std::int64_t, double, std::string, std::vector<std::string>,
                                 Pairs, DescriptionRef>;

/// The options of one device or line. Every option that the protocol declares is present: given by
/// the user, by the profile, or as default. So the getters do not return defaults: if no option has
/// the name, or it has another kind, they throw std::out_of_range or std::bad_variant_access.
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

  /// Stores the text as written, for options that were given and are not secret, so that the
  /// configuration can be printed.
  void SetWritten(std::string name, std::string text) {
    written_[std::move(name)] = std::move(text);
  }
  const std::map<std::string, std::string>& written() const { return written_; }

 private:
  std::map<std::string, OptionValue> values_;
  std::map<std::string, std::string> written_;
};

// Traits are properties of a protocol that other parts, such as gateway/outputs/status, use instead
// of its name. The protocol sets them (Protocol::traits), and the configuration passes them on.
class Options;
struct Point;

struct Traits {
  /// Name of the network protocol, for a protocol that talks to a TCP server: "Modbus TCP". Empty:
  /// the protocol runs on serial lines.
  std::string_view service{};
  /// The protocol for the same devices at the other kind of port. For modbus_rtu it is
  /// "modbus_tcp", because a Modbus gateway may be there instead of a plain serial server; for
  /// modbus_tcp it is "modbus_rtu". Empty: no such protocol exists.
  std::string_view counterpart{};
  /// True: a request can read several points, and the user can limit their number (`block`,
  /// `max_items`).
  bool has_blocks = false;
  /// The address to which every device replies, whatever its own address is. Empty: the protocol
  /// has no such address.
  std::string_view common_address{};
  bool speaks_text = false;
  /// True: the device option `order` sets the byte order of numbers.
  bool has_byte_order = false;
  /// True: a device can answer some requests only in a mode that is selected at the device, such as
  /// remote control.
  bool has_modes = false;

  /// The form of replies that consist of registers. A check value or a header proves that a reply
  /// is complete. So a complete reply of another length answers a request for another number of
  /// registers.
  struct RegisterReply {
    std::size_t around = 0;  ///< characters of a reply besides its registers
    std::size_t each = 0;    ///< characters of one register; 0: replies contain no registers
  };
  RegisterReply register_reply{};

  /// Returns true if replies to a device with these options have no check value, so that a damaged
  /// reply can look undamaged. Null: replies always have a check value.
  bool (*is_unchecked)(const Options& options) = nullptr;
  /// Characters that cannot occur inside an undamaged reply without a check value.
  std::string_view never_in_reply{};

  /// Returns true if the point is a setting that a user changes at the device itself. Null: no
  /// point is such a setting.
  bool (*is_setting)(const Point& point) = nullptr;
  /// The key `read` of the point that contains the device's designation, the text that a user has
  /// given to the device. Empty: no point contains it.
  std::string_view designation{};
};

inline constexpr Traits kNoTraits;

}  // namespace baudgate::config
