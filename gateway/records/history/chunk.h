// Many entries of one point as few bytes, and back: columns of differences, then zlib.
//
//   byte 0, 1, 2   version (1), ValueCode, decimals
//   number         bytes of what follows before zlib
//   zlib over      count, time of the first, then how each step in time differs from the one before
//                  qualities: how many, which, …
//                  how many have a value, how many have none, how many have one again, …
//                  values of those that have one
//
// Numbers: 7 bits a byte, low ones first; signed ones by ZigZag. docs/history.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/records/history/entry.h"

namespace baudgate::history {

/// More are never in one.
inline constexpr std::size_t kMostInChunk = 20'000;
/// Longer texts are cut before they come here.
inline constexpr std::size_t kLongestText = 250;

/// At most kMostInChunk, with times that rise from each to the next, from 1 on. Empty: no memory.
Bytes EncodeChunk(std::span<const Entry> entries);
/// Exactly what was encoded. Empty: these bytes are no chunk.
std::optional<std::vector<Entry>> DecodeChunk(View bytes);

}  // namespace baudgate::history
