// The members of the configuration's structs, listed one by one. Each struct has a function
// VisitFields with one row for each member. Comparison, the reader of the key (MapReader::Read),
// docs/keys.md and the man page are derived from the rows.
//
//     template <typename Visit>
//     void VisitFields(const PortServer*, Visit visit) {
//       visit(Field<&PortServer::mode>{.help = "raw: bytes as they are; rfc2217: telnet"});
//       visit(Field<&PortServer::time>{"for", "of lend: the longest time", 1s, 24h});
//     }
//
// tests/config/model/fields_test.cpp fails if a member is missing, tests/config/keys_test.cpp if
// docs/keys.md differs from the rows.
//
// `Shared` is a value that its copies share.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate::config {

// Shared is a value that its copies share, to save memory: a thousand devices of one profile share
// one description of each point, and one file name.

/// The value is immutable; assignment replaces it. Without a value it reads as T{}.
template <typename T>
class Shared {
 public:
  Shared() = default;
  Shared(T value) : value_(std::make_shared<const T>(std::move(value))) {}
  template <std::size_t kSize>
  Shared(const char (&text)[kSize]) requires std::is_same_v<T, std::string>
      : Shared(std::string(text)) {}

  explicit operator bool() const { return value_ != nullptr; }
  const T& operator*() const {
    static const T kNone{};
    return value_ ? *value_ : kNone;
  }
  const T* operator->() const { return &**this; }
  operator const T&() const { return **this; }

 private:
  std::shared_ptr<const T> value_;
};

/// Returns "jump" for &Point::jump, "strip" for Echo::strip: the compiler's name, from the last
/// "::" to the end of the list. A number without an enumerator gives "Echo)3".
template <auto kMember>
constexpr std::string_view MemberName() {
  std::string_view name = __PRETTY_FUNCTION__;
  name = name.substr(0, name.find_first_of(";]", name.find("kMember = ")));
  return name.substr(name.rfind(':') + 1);
}

template <typename T>
struct Word {
  std::string_view word;
  T meaning;
};
inline constexpr std::array<Word<bool>, 2> kDenyAllow = {{{"deny", false}, {"allow", true}}};

/// The text in the column "default" of the table of keys if a key is mandatory.
inline constexpr std::string_view kRequired = "required";

template <typename E, std::size_t kCount = 0>
constexpr auto WordsOfNames() {
  if constexpr (MemberName<static_cast<E>(kCount)>().find(')') == std::string_view::npos) {
    return WordsOfNames<E, kCount + 1>();
  } else {
    std::array<Word<E>, kCount> words;
    const auto set = [&words]<std::size_t... kIndices>(std::index_sequence<kIndices...>) {
      ((words[kIndices] = {MemberName<static_cast<E>(kIndices)>(), static_cast<E>(kIndices)}), ...);
    };
    set(std::make_index_sequence<kCount>());
    return words;
  }
}

/// The words of an enumeration: the names of its enumerators, unless there is a specialisation.
template <typename E>
inline constexpr auto kWords = WordsOfNames<E>();

/// Returns the first word of kWords for this value, such as "strip" for Echo::strip; empty if the
/// value has no word.
template <typename E>
requires std::is_enum_v<E>
constexpr std::string_view Name(E value) {
  for (const Word<E>& one : kWords<E>) {
    if (one.meaning == value) return one.word;
  }
  return {};
}

template <typename Struct, typename T>
T ValueOf(T Struct::*);
template <typename Struct, typename T>
T ValueOf(std::optional<T> Struct::*);

/// A setting with its key in the file and in messages. docs/keys.md lists it only if `help` is set.
template <auto kMember>
struct Field {
  using Value = decltype(ValueOf(kMember));
  using Bound =
      std::conditional_t<std::integral<Value> || std::same_as<Value, Duration>, Value, int>;
  static constexpr std::span<const Word<Value>> Words() {
    if constexpr (std::is_enum_v<Value>) return kWords<Value>;
    return {};
  }

  static constexpr auto member = kMember;
  static constexpr bool is_setting = true;
  std::string_view key = MemberName<kMember>();
  std::string_view help{};
  Bound least{};
  Bound most{};
  std::string_view fallback{};  ///< the default, if it differs from the member's initial value
  std::span<const Word<Value>> words = Words();
};

/// A key that sets several members, or a member that another key can set, too.
struct Key {
  static constexpr bool is_setting = false;
  std::string_view key;
  std::string_view help{};
  std::string_view allowed{};
  std::string_view fallback{};
};

/// A member that no key sets: a position in the file, or a value computed from other settings.
template <auto kMember>
struct Derived {
  static constexpr auto member = kMember;
  static constexpr bool is_setting = false;
  std::string_view key = MemberName<kMember>();
};

struct AnyVisit {
  void operator()(auto) const {}
};
template <typename T>
concept HasFields = requires(const T* its) {
  VisitFields(its, AnyVisit());
};

template <typename T>
bool Same(const T& a, const T& b);

template <typename T>
bool Same(const std::vector<T>& a, const std::vector<T>& b) {
  return std::ranges::equal(a, b, [](const T& one, const T& other) { return Same(one, other); });
}

template <typename T>
bool Same(const Shared<T>& a, const Shared<T>& b) {
  return Same(*a, *b);
}

template <typename T>
bool Same(const std::optional<T>& a, const std::optional<T>& b) {
  return a.has_value() == b.has_value() && (!a || Same(*a, *b));
}

template <HasFields T, typename Tell>
void EachDifferent(const T& a, const T& b, Tell tell) {
  VisitFields(&a, [&](auto field) {
    if constexpr (field.is_setting) {
      if (!Same(a.*field.member, b.*field.member)) tell(field.key);
    }
  });
}

/// Returns the keys of the settings that differ: "port, serial".
template <HasFields T>
std::string DifferentKeys(const T& a, const T& b) {
  std::string keys;
  EachDifferent(a, b, [&keys](std::string_view key) {
    keys += (keys.empty() ? "" : ", ") + std::string(key);
  });
  return keys;
}

template <typename T>
bool Same(const T& a, const T& b) {
  if constexpr (HasFields<T>) {
    bool same = true;
    EachDifferent(a, b, [&same](std::string_view) { same = false; });
    return same;
  } else {
    return a == b;
  }
}

}  // namespace baudgate::config
