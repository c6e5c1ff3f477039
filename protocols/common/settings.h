// `SettingsTable` reads a device's options into a struct of its protocol. Each row contains the
// key, kind, default and help of an option, and the struct member that the option fills:
//
//   struct Settings { bool checksum; std::size_t width; Format format; };
//   constexpr auto kTable = SettingsTable(
//       Bind<&Settings::checksum>(option::Flag("checksum", "false", "…")),
//       Bind<&Settings::width>(option::Integer("width", "7", 0, 32, "…")),
//       Bind<&Settings::format>(option::Choice("format", "hex", "decimal,hex", "…")));
//
// kTable.specs() is the value for Protocol::options; kTable.Read(device.options) returns the
// Settings. The protocol's functions take a const Settings&; kWithSettings adapts them to the
// ParsedOptions in Protocol:
//
//   .parse = ParseWith<ReadSettings>, .expect = kWithSettings<Expect>
//
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "config/model/options.h"
#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "protocols/options.h"

namespace baudgate::protocols {
namespace settings {

/// Returns the position of `word` in the list `choices`: in "auto,a,b" the word auto has position
/// 0. Returns 0 if the list does not contain the word.
constexpr std::size_t IndexOf(std::string_view word, std::string_view choices) {
  std::size_t index = 0;
  for (std::size_t at = 0; at < choices.size(); ++index) {
    const std::size_t end = std::min(choices.find(',', at), choices.size());
    if (choices.substr(at, end - at) == word) return index;
    at = end + 1;
  }
  return 0;
}

template <typename T>
inline constexpr bool kIsOptional = false;
template <typename T>
inline constexpr bool kIsOptional<std::optional<T>> = true;

template <typename T>
T Get(const config::Options& options, const OptionSpec& spec) {
  const std::string name(spec.name);
  if constexpr (kIsOptional<T>) {
    const auto number = Get<typename T::value_type>(options, spec);
    return number == 0 ? T() : T(number);
  } else if constexpr (std::is_enum_v<T>) {
    return static_cast<T>(IndexOf(options.Text(name), spec.choices));
  } else if constexpr (std::is_same_v<T, bool>) {
    return spec.kind == OptionSpec::Kind::choice ? IndexOf(options.Text(name), spec.choices) != 0
                                                 : options.Flag(name);
  } else if constexpr (std::is_same_v<T, Duration>) {
    return options.Time(name);
  } else if constexpr (std::is_floating_point_v<T>) {
    return spec.kind == OptionSpec::Kind::real ? options.Real(name)
                                               : static_cast<T>(options.Integer(name));
  } else if constexpr (std::is_integral_v<T>) {
    return static_cast<T>(options.Integer(name));
  } else if constexpr (std::is_same_v<T, std::string>) {
    return options.Text(name);
  } else {
    return options.Texts(name);
  }
}

template <typename Settings>
using Reader = Status (*)(const config::Options&, const OptionSpec&, Settings&);

template <typename Settings>
struct Row {
  OptionSpec spec;
  Reader<Settings> read = nullptr;
};

template <typename T>
struct Member;
template <typename Settings, typename T>
struct Member<T Settings::*> {
  using Of = Settings;
  using Type = T;
};

template <auto kFunction, typename Type = decltype(kFunction)>
struct Untyped;
template <auto kFunction, typename Outcome, typename Settings>
struct Untyped<kFunction, Outcome (*)(View, const Settings&)> {
  static Outcome Call(View bytes, const ParsedOptions& options) {
    return kFunction(bytes, options.As<Settings>());
  }
};
template <auto kFunction, typename Outcome, typename Settings>
struct Untyped<kFunction, Outcome (*)(View, View, const Settings&)> {
  static Outcome Call(View request, View heard, const ParsedOptions& options) {
    return kFunction(request, heard, options.As<Settings>());
  }
};

}  // namespace settings

/// Makes a function for Protocol::parse from kRead, which reads Settings from options.
template <auto kRead>
ParsedOptions ParseWith(const config::Options& options) {
  return ParsedOptions::Of(kRead(options));
}

/// Makes a function for Protocol::expect or Protocol::recognise from kFunction: ParsedOptions in
/// its signature replace the Settings.
template <auto kFunction>
inline constexpr auto kWithSettings = &settings::Untyped<kFunction>::Call;

/// Binds an option to the member that it fills. Options of the kinds number, duration and text fill
/// members of that type; an optional number stays empty if the option is 0. A choice fills an enum
/// whose enumerators are in the order of the words. A choice of two words can also fill a bool,
/// which is true for the second word.
template <auto kMember>
constexpr auto Bind(const OptionSpec& spec) {
  using Settings = typename settings::Member<decltype(kMember)>::Of;
  using Type = typename settings::Member<decltype(kMember)>::Type;
  return settings::Row<Settings>{
      spec, [](const config::Options& options, const OptionSpec& row, Settings& settings) {
        settings.*kMember = settings::Get<Type>(options, row);
        return Status();
      }};
}

/// Binds an option to a member through kParse, which converts the text or texts of the option to
/// the member's type: Result<Type> kParse(const std::string&), or of const
/// std::vector<std::string>&. If kParse fails, the member keeps its default, and Check returns the
/// error.
template <auto kMember, auto kParse>
constexpr auto Bind(const OptionSpec& spec) {
  using Settings = typename settings::Member<decltype(kMember)>::Of;
  return settings::Row<Settings>{
      spec, [](const config::Options& options, const OptionSpec& row, Settings& settings) {
        const auto parse = [&] {
          const std::string name(row.name);
          if constexpr (std::is_invocable_v<decltype(kParse), const std::string&>) {
            return kParse(options.Text(name));
          } else {
            return kParse(options.Texts(name));
          }
        };
        auto parsed = parse();
        if (!parsed) return Status(Error{parsed.error()});
        settings.*kMember = std::move(*parsed);
        return Status();
      }};
}

template <typename Settings, std::size_t kCount>
class SettingsTable {
 public:
  template <typename... Rows>
  constexpr explicit SettingsTable(const settings::Row<Settings>& first, const Rows&... rest)
      : specs_{first.spec, rest.spec...}, readers_{first.read, rest.read...} {}

  constexpr std::span<const OptionSpec> specs() const { return specs_; }

  /// Returns the settings for `options`, which must contain all options of the table.
  Settings Read(const config::Options& options) const {
    Settings settings{};
    for (std::size_t i = 0; i < kCount; ++i) {
      (void)readers_[i](options, specs_[i], settings);
    }
    return settings;
  }

  Status Check(const config::Options& options) const {
    Settings settings{};
    for (std::size_t i = 0; i < kCount; ++i) {
      if (Status status = readers_[i](options, specs_[i], settings); !status) return status;
    }
    return {};
  }

 private:
  std::array<OptionSpec, kCount> specs_;
  std::array<settings::Reader<Settings>, kCount> readers_;
};

template <typename Settings, typename... Rows>
SettingsTable(const settings::Row<Settings>&, const Rows&...)
    -> SettingsTable<Settings, 1 + sizeof...(Rows)>;

}  // namespace baudgate::protocols
