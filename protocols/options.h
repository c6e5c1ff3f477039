// The keys that a protocol adds to devices in the configuration, such as `checksum: true`: one row
// for each, made by the functions below. The configuration reads and checks them by these rows;
// protocols/common/settings.h puts them into a struct of the protocol, and ParsedOptions carries
// that struct through the gateway.
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
    device,  ///< stands at devices and in profiles; at a line it holds for all its devices
    line,    ///< stands at lines only
  };
  std::string_view name{};
  Kind kind = Kind::text;
  std::string_view fallback{};  ///< as the user would write it; of texts and pairs: with commas
  std::string_view help{};      ///< one sentence
  Scope scope = Scope::device;
  double minimum = 0;  ///< of integer and real; no bounds where minimum = maximum
  double maximum = 0;
  std::string_view choices{};  ///< of choice, separated by commas
  bool secret = false;         ///< the value is never shown, in no log and by no command
};

namespace option {

/// true or false.
constexpr OptionSpec Flag(std::string_view name, std::string_view fallback, std::string_view help) {
  OptionSpec spec;
  spec.name = name;
  spec.kind = OptionSpec::Kind::flag;
  spec.fallback = fallback;
  spec.help = help;
  return spec;
}

/// A whole number from `low` to `high`, both allowed; 0 and 0: any number.
constexpr OptionSpec Integer(std::string_view name, std::string_view fallback, double low,
                             double high, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::integer;
  spec.minimum = low;
  spec.maximum = high;
  return spec;
}

/// A decimal number; bounds as for Integer.
constexpr OptionSpec Real(std::string_view name, std::string_view fallback, double low, double high,
                          std::string_view help) {
  OptionSpec spec = Integer(name, fallback, low, high, help);
  spec.kind = OptionSpec::Kind::real;
  return spec;
}

/// "50ms", "2s".
constexpr OptionSpec Time(std::string_view name, std::string_view fallback, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::duration;
  return spec;
}

/// Any text.
constexpr OptionSpec Text(std::string_view name, std::string_view fallback, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::text;
  return spec;
}

/// A list of texts; `fallback` separated by commas.
constexpr OptionSpec Texts(std::string_view name, std::string_view fallback,
                           std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::texts;
  return spec;
}

/// Words that the user chooses, each with a text: { channel: 2 }, or "channel=2". A device's are
/// put over those of its profile.
constexpr OptionSpec Pairs(std::string_view name, std::string_view fallback,
                           std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::pairs;
  return spec;
}

/// A part of the file that the protocol reads itself (Protocol::describe).
constexpr OptionSpec Described(std::string_view name, std::string_view help) {
  OptionSpec spec = Flag(name, "", help);
  spec.kind = OptionSpec::Kind::description;
  return spec;
}

/// One word of several; `choices` separated by commas: "auto,a,b".
constexpr OptionSpec Choice(std::string_view name, std::string_view fallback,
                            std::string_view choices, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::choice;
  spec.choices = choices;
  return spec;
}

/// The same option, for the line as a whole: it stands at lines only.
constexpr OptionSpec OnLine(OptionSpec spec) {
  spec.scope = OptionSpec::Scope::line;
  return spec;
}

/// The same option, never shown: Secret(Text("password", …)).
constexpr OptionSpec Secret(OptionSpec spec) {
  spec.secret = true;
  return spec;
}

}  // namespace option

// The options of a device as its protocol uses them. Protocol::parse makes them once a device;
// every function of the protocol that depends on options gets them. Only the protocol knows their
// type:
//
//   ParsedOptions::Of(Settings{.checksum = true})      in `parse`
//   options.As<Settings>().checksum                    in `expect`
//
class ParsedOptions {
 public:
  /// For a protocol without options.
  ParsedOptions() = default;

  template <typename Settings>
  static ParsedOptions Of(Settings settings) {
    ParsedOptions options;
    options.settings_ = std::make_shared<const Settings>(std::move(settings));
    return options;
  }

  /// `Settings`: the type that the protocol's `parse` has given to Of.
  template <typename Settings>
  const Settings& As() const {
    return *static_cast<const Settings*>(settings_.get());
  }

 private:
  std::shared_ptr<const void> settings_;
};

}  // namespace baudgate::protocols
