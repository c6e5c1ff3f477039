// The check values that a description may name.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "gateway/base/bytes.h"

namespace baudgate::protocols::telegram {

struct ChecksumKind {
  std::string_view name;
  std::size_t bytes = 1;
  std::uint32_t (*compute)(View bytes) = nullptr;
};

std::span<const ChecksumKind> ChecksumKinds();

/// The check value of a telegram: over the bytes in front of the field `checksum`, without the
/// first `skip` and the last `leave` of them.
struct Checksum {
  const ChecksumKind* kind = nullptr;  ///< null: none
  std::size_t skip = 0;
  std::size_t leave = 0;

  /// `front`: all in front of the field. Empty: it is too short.
  std::optional<std::uint32_t> Of(View front) const;
};

}  // namespace baudgate::protocols::telegram
