// Places of `read` that have a name where others have a table and an address: "event counter",
// "identification product"; and bits in brackets: "[b3-b5]". Parts of the grammar in points.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocols/modbus/points.h"

namespace baudgate::protocols::modbus {

/// Function 43/14: what is read of a device's identification, and where the maker's objects begin.
enum Category : std::uint16_t { kBasic = 1, kRegular = 2, kExtended = 3 };
/// The first objects of an identification.
enum Object : std::size_t { kVendor = 0, kProduct = 1 };
inline constexpr unsigned kFirstOwnObject = 0x80;

/// "'holding 200[b16]' names no bits ...".
Error Wrong(std::string_view text, const std::string& why);

/// "[b3]" or "[b3-b5]".
Status TakeBits(std::string_view text, std::string_view inside, Place& place);

/// "exception status[b3]", "server id[2]", "identification 0x80". Empty: it is none of these.
std::optional<Result<Place>> ParseNamed(std::string_view text,
                                        std::span<const std::string_view> words);

}  // namespace baudgate::protocols::modbus
