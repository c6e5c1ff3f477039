// Shared by all fuzz targets: a reader of the fuzzer's bytes, and a check that ends the run.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "gateway/base/bytes.h"

namespace baudgate::fuzz {

inline void Require(bool kept, std::string_view promise) {
  if (kept) return;
  std::fprintf(stderr, "not kept: %.*s\n", static_cast<int>(promise.size()), promise.data());
  std::abort();
}

/// Reads the fuzzer's bytes from front to back; behind their end, it returns zeros and empty views.
class Input {
 public:
  explicit Input(View bytes) : rest_(bytes) {}

  bool empty() const { return rest_.empty(); }
  std::uint8_t U8() {
    const View one = Take(1);
    return one.empty() ? std::uint8_t{0} : one[0];
  }
  std::size_t Below(std::size_t limit) {
    const std::size_t byte = U8();
    return limit == 0 ? 0 : byte % limit;
  }
  View Take(std::size_t count) {
    const View taken = rest_.first(std::min(count, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  View TakeCounted() { return Take(U8()); }
  View Rest() { return Take(rest_.size()); }

 private:
  View rest_;
};

}  // namespace baudgate::fuzz
