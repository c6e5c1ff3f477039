// A port that is open for a server, before anything is asked there.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>

#include "config/model/web.h"
#include "gateway/base/result.h"

namespace baudgate::web {

class ListenSocket {
 public:
  ListenSocket() = default;
  ~ListenSocket();
  ListenSocket(ListenSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  ListenSocket& operator=(ListenSocket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }

  /// The error names the place and what is wrong with it.
  static Result<ListenSocket> Open(const config::Web& web);
  bool is_open() const { return descriptor_ >= 0; }
  /// The one that the system has chosen, where 0 was asked for.
  std::uint16_t port() const;
  /// It is somebody else's from now on.
  int Release() { return std::exchange(descriptor_, -1); }

 private:
  explicit ListenSocket(int descriptor) : descriptor_(descriptor) {}
  int descriptor_ = -1;
};

}  // namespace baudgate::web
