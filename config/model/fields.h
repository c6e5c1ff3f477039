// The members of the configuration's structs, one by one. Beside each struct stands its visitor,
// which names every member once; comparison, defaults and tests go through it:
//
//     template <typename Visit>
//     void VisitFields(const Sentinel*, Visit visit) {
//       visit(Field<&Sentinel::value>());
//       visit(Field<&Sentinel::quality>());
//     }
//
// tests/config/model/fields_test.cpp fails where a member is missing.
//
// Shared is a value that its copies share.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace baudgate::config {

// A value that its copies share: the thousand devices of a profile have one description of each
// point, and one name of the file that it comes from.

/// The value never changes; another one takes its place. Reads as T{} where none was given.
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

/// "jump" of &Point::jump: what the compiler calls it, between the last "::" and the end of the
/// list.
template <auto kMember>
constexpr std::string_view MemberName() {
  std::string_view name = __PRETTY_FUNCTION__;
  name = name.substr(0, name.find_first_of(";]", name.find("kMember = ")));
  return name.substr(name.rfind(':') + 1);
}

/// A setting, and the key that messages name it by.
template <auto kMember>
struct Field {
  static constexpr auto member = kMember;
  static constexpr bool is_setting = true;
  std::string_view key = MemberName<kMember>();
};

/// A member that is no setting: a place in the file, or what follows from settings.
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

/// Calls `tell` with the key of each setting that differs.
template <HasFields T, typename Tell>
void EachDifferent(const T& a, const T& b, Tell tell) {
  VisitFields(&a, [&](auto field) {
    if constexpr (field.is_setting) {
      if (!Same(a.*field.member, b.*field.member)) tell(field.key);
    }
  });
}

/// "port, serial": the settings that differ.
template <HasFields T>
std::string DifferentKeys(const T& a, const T& b) {
  std::string keys;
  EachDifferent(a, b, [&keys](std::string_view key) {
    keys += (keys.empty() ? "" : ", ") + std::string(key);
  });
  return keys;
}

/// All settings are equal, those of structs in it included.
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
