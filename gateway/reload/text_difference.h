// The lines in which two texts differ, for `baudgate config diff`.
//
//   a b c  and  a x c   →   "  a", "- b", "+ x", "  c"    with at most `context` lines around
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::reload {

/// Each begins with "  ", "- " (only in `before`) or "+ " (only in `after`); "…" where lines that
/// are the same are left out. Empty: they are the same.
std::vector<std::string> TextDifference(std::string_view before, std::string_view after,
                                        std::size_t context = 2);

}  // namespace baudgate::reload
