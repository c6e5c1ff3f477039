// The options that a protocol adds to devices in the configuration, such as `checksum: true`. An
// OptionSpec describes one option; the functions below make OptionSpecs. The configuration reads
// and checks options by their OptionSpec, protocols/common/settings.h fills a struct of the
// protocol with them, and ParsedOptions carries the struct through the gateway.
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
    /// The option is allowed at devices and in profiles; at a line, it is the default of all
    /// devices of the line.
    device,
    line,
  };
  std::string_view name{};
  Kind kind = Kind::text;
  /// The default, as a user would write it; for texts and pairs: separated by commas.
  std::string_view fallback{};
  std::string_view help{};
  Scope scope = Scope::device;
  double minimum = 0;  ///< bounds of an integer or a real; equal bounds: any number is allowed
  double maximum = 0;
  std::string_view choices{};
  bool secret = false;  ///< true: no log and no command shows the value
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

/// Describes a whole number from `low` to `high` inclusive; if both are 0, any number is allowed.
constexpr OptionSpec Integer(std::string_view name, std::string_view fallback, double low,
                             double high, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::integer;
  spec.minimum = low;
  spec.maximum = high;
  return spec;
}

/// Describes a decimal number from `low` to `high` inclusive; if both are 0, any number is allowed.
constexpr OptionSpec Real(std::string_view name, std::string_view fallback, double low, double high,
                          std::string_view help) {
  OptionSpec spec = Integer(name, fallback, low, high, help);
  spec.kind = OptionSpec::Kind::real;
  return spec;
}

/// Describes an option whose value is a duration, such as "50ms" or "2s".
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

constexpr OptionSpec Texts(std::string_view name, std::string_view fallback,
                           std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::texts;
  return spec;
}

/// Describes a map of words to texts, both chosen by the user: { channel: 2 }, or "channel=2".
/// Pairs of a device override those of its profile.
constexpr OptionSpec Pairs(std::string_view name, std::string_view fallback,
                           std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::pairs;
  return spec;
}

/// Describes an option whose part of the configuration file the protocol parses by itself
/// (Protocol::describe).
constexpr OptionSpec Described(std::string_view name, std::string_view help) {
  OptionSpec spec = Flag(name, "", help);
  spec.kind = OptionSpec::Kind::description;
  return spec;
}

/// Describes a word out of `choices`, which are separated by commas: "auto,a,b".
constexpr OptionSpec Choice(std::string_view name, std::string_view fallback,
                            std::string_view choices, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::choice;
  spec.choices = choices;
  return spec;
}

constexpr OptionSpec OnLine(OptionSpec spec) {
  spec.scope = OptionSpec::Scope::line;
  return spec;
}

constexpr OptionSpec Secret(OptionSpec spec) {
  spec.secret = true;
  return spec;
}

}  // namespace option

// The parsed options of a device. Protocol::parse makes them once for each device, and every
// function of the protocol that depends on options gets them. The type of their contents is private
// to the protocol:
//
//   ParsedOptions::Of(Settings{.checksum = true})      in `parse`
//   options.As<Settings>().checksum                    in `expect`
//
class ParsedOptions {
 public:
  /// Makes an empty object, for a protocol without options.
  ParsedOptions() = default;

  template <typename Settings>
  static ParsedOptions Of(Settings settings) {
    ParsedOptions options;
    options.settings_ = std::make_shared<const Settings>(std::move(settings));
    return options;
  }

  /// Returns the contents. `Settings` must be the type that the protocol's `parse` passed to Of.
  template <typename Settings>
  const Settings& As() const {
    return *static_cast<const Settings*>(settings_.get());
  }

 private:
  std::shared_ptr<const void> settings_;
};

}  // namespace baudgate::protocols
