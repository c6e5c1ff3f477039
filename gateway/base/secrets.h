// Random numbers, digests and comparisons of secrets.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace baudgate {

/// Returns `bytes` random bytes of the kernel in hex: two digits for each byte.
std::string RandomHex(std::size_t bytes);

/// Returns the SHA-256 digest of the text in hex.
std::string Sha256Hex(std::string_view text);

/// Compares two secrets. The time does not depend on the position of the first difference.
bool SameSecret(std::string_view a, std::string_view b);

}  // namespace baudgate
