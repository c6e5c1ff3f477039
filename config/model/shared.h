// A value that its copies share: the thousand devices of a profile have one description of each
// point, and one name of the file that it comes from.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

namespace baudgate::config {

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

}  // namespace baudgate::config
