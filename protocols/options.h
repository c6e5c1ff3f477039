// The options that a protocol adds to devices in the configuration, such as `checksum: true`. An
// OptionSpec describes one option; the functions below make it. The configuration reads and checks
// options by their OptionSpec, protocols/common/settings.h fills a struct of the protocol with
// them, and ParsedOptions carries the struct through the gateway.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

namespace baudgate::protocols {

struct OptionSpec {
  enum class Kind : std::uint8_t {
    flag,
    integer,
    real,
    text,
    duration,
    choice,
    texts,
    pairs,
    description,
  };
  enum class Scope : std::uint8_t {
    device,  ///< allowed at devices and in profiles; at a line, it is the default of all its
             ///< devices
    line,    ///< allowed at lines only
  };
  std::string_view name{};
  Kind kind = Kind::text;
  std::string_view fallback{};  ///< the default, as a user would write it; of texts and pairs:
                                ///< separated by commas
  std::string_view help{};      ///< one sentence
  Scope scope = Scope::device;
  double minimum = 0;  ///< bounds of integer and real; no bounds if both are equal
  double maximum = 0;
  std::string_view choices{};  ///< the words of a choice, separated by commas
  bool secret = false;         ///< true: no log and no command shows the value
};

namespace option {

constexpr OptionSpec Flag(std::string_view name, std::string_view fallback, std::string_view help) {
  OptionSpec spec;
  spec.name = name;
  spec.kind = OptionSpec::Kind::flag;
  spec.fallback = fallback;
  spec.help = help;
  return spec;
}

/// A whole number from `low` to `high` inclusive; 0 and 0: any number.
constexpr OptionSpec Integer(std::string_view name, std::string_view fallback, double low,
                             double high, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::integer;
  spec.minimum = low;
  spec.maximum = high;
  return spec;
}

/// A decimal number with the bounds of Integer.
constexpr OptionSpec Real(std::string_view name, std::string_view fallback, double low, double high,
                          std::string_view help) {
  OptionSpec spec = Integer(name, fallback, low, high, help);
  spec.kind = OptionSpec::Kind::real;
  return spec;
}

/// A duration: "50ms", "2s".
constexpr OptionSpec Time(std::string_view name, std::string_view fallback, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::duration;
  return spec;
}

constexpr OptionSpec Text(std::string_view name, std::string_view fallback, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::text;
  return spec;
}

/// A list of texts; `fallback` is separated by commas.
constexpr OptionSpec Texts(std::string_view name, std::string_view fallback,
                           std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::texts;
  return spec;
}

/// A map of words to texts, both chosen by the user: { channel: 2 }, or "channel=2". Pairs of a
/// device override those of its profile.
constexpr OptionSpec Pairs(std::string_view name, std::string_view fallback,
                           std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::pairs;
  return spec;
}

/// A part of the file that the protocol parses by itself (Protocol::describe).
constexpr OptionSpec Described(std::string_view name, std::string_view help) {
  OptionSpec spec = Flag(name, "", help);
  spec.kind = OptionSpec::Kind::description;
  return spec;
}

/// One word out of `choices`, which are separated by commas: "auto,a,b".
constexpr OptionSpec Choice(std::string_view name, std::string_view fallback,
                            std::string_view choices, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::choice;
  spec.choices = choices;
  return spec;
}

/// Makes an option one that is allowed at lines only.
constexpr OptionSpec OnLine(OptionSpec spec) {
  spec.scope = OptionSpec::Scope::line;
  return spec;
}

/// Makes an option secret: Secret(Text("password", …)).
constexpr OptionSpec Secret(OptionSpec spec) {
  spec.secret = true;
  return spec;
}

}  // namespace option

// The parsed options of a device. Protocol::parse makes them once for each device, and every
// function of the protocol that depends on options gets them. Their type is private to the
// protocol:
//
//   ParsedOptions::Of(Settings{.checksum = true})      in `parse`
//   options.As<Settings>().checksum                    in `expect`
//
class ParsedOptions {
 public:
  /// Makes the value for a protocol without options.
  ParsedOptions() = default;

  template <typename Settings>
  static ParsedOptions Of(Settings settings) {
    ParsedOptions options;
    options.settings_ = std::make_shared<const Settings>(std::move(settings));
    return options;
  }

  /// `Settings` must be the type that the protocol's `parse` passed to Of.
  template <typename Settings>
  const Settings& As() const {
    return *static_cast<const Settings*>(settings_.get());
  }

 private:
  std::shared_ptr<const void> settings_;
};

}  // namespace baudgate::protocols
