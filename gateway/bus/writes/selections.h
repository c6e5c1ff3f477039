// Which points are selected, by which client and until when. A point that trips or resets something
// is written in two steps, so that one wrong register number moves nothing.
//
//   select 100 by client 7 at 0 s, for 10 s
//   take   100 by client 8 at 1 s             no: another client's
//   take   100 by client 7 at 3 s             yes, once
//   take   100 by client 7 at 4 s             no: it is used up
//
// Knows no clock. docs/writes.md, "Select before operate".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>

#include "gateway/base/time.h"

namespace baudgate {

class Selections {
 public:
  /// Most selections at a time; one more drops the one that ends first.
  static constexpr std::size_t kLimit = 1024;

  struct Point {
    std::uint32_t device = 0;  ///< index in the point store
    std::uint32_t point = 0;   ///< index in the device's points
    auto operator<=>(const Point&) const = default;
  };
  enum class Verdict : std::uint8_t {
    selected,
    none,     ///< not selected
    expired,  ///< its time is over
    foreign,  ///< selected by another client
  };

  void Select(std::uint64_t client, Point point, Instant until);
  /// Uses up the client's own selection.
  Verdict Take(std::uint64_t client, Point point, Instant now);
  /// The client has left.
  void Forget(std::uint64_t client);

  std::size_t size() const { return until_.size(); }

 private:
  struct Key {
    Point point;
    std::uint64_t client = 0;
    auto operator<=>(const Key&) const = default;
  };
  std::map<Key, Instant> until_;
};

}  // namespace baudgate
