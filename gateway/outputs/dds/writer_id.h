// Who wrote a sample, as RTPS names it. Comes from gateway/outputs/dds/fast, is shown by
// gateway/tools/watch.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string>

#include "gateway/base/time.h"

namespace baudgate::dds {

/// A participant: one process of one gateway, whose writers may be many. Whoever reaches the domain
/// can use another's.
struct PublisherId {
  std::array<std::uint8_t, 12> bytes{};
  auto operator<=>(const PublisherId&) const = default;
};

struct WriterId {
  PublisherId publisher;
  std::array<std::uint8_t, 4> entity{};
  auto operator<=>(const WriterId&) const = default;
};

/// As Fast DDS writes them: "01.0f.0a.1b.2c.3d.00.00.01.00.00.00" and the same with "|0.0.1.2".
std::string Text(const PublisherId& id);
std::string Text(const WriterId& id);

/// Where a sample came from.
struct Origin {
  WriterId writer;
  WallTime received;
};

}  // namespace baudgate::dds
