// Fuzzes the reader of history files. The first byte chooses what the other bytes are: a whole
// file; columns that the target compresses, so that they pass the checksum of zlib; or entries that
// must be read back unchanged.
// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>

#include <bit>
#include <cmath>

#include "gateway/records/history/chunk.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

using namespace history;

void DecodeAny(View bytes) {
  const auto entries = DecodeChunk(bytes);
  if (!entries) return;
  Require(!entries->empty() && entries->size() <= kMostInChunk, "a chunk is bounded");
  for (std::size_t i = 1; i < entries->size(); ++i) {
    Require((*entries)[i].time > (*entries)[i - 1].time, "times rise");
  }
}

Bytes Packed(Input& input) {
  Bytes chunk = {1, input.U8(), input.U8()};
  const View plain = input.Rest();
  ColumnWriter size;
  size.Unsigned(plain.size());
  Append(chunk, View(size.bytes()));
  const std::size_t begin = chunk.size();
  uLongf room = compressBound(plain.size());
  chunk.resize(begin + room);
  compress2(chunk.data() + begin, &room, plain.data(), plain.size(), 1);
  chunk.resize(begin + room);
  return chunk;
}

std::uint64_t Bits(Input& input) {
  std::uint64_t bits = 0;
  for (const std::uint8_t byte : input.Take(1 + input.Below(8))) bits = bits << 8U | byte;
  return bits;
}

Value AnyEntryValue(Input& input) {
  switch (input.Below(7)) {
    case 0:
      return {};
    case 1:
      return input.U8() % 2 == 1;
    case 2:
      return static_cast<std::int64_t>(Bits(input));
    case 3:
      return Bits(input);
    case 4: {
      const double number = std::bit_cast<double>(Bits(input));
      return std::isnan(number) ? Value() : Value(number);
    }
    case 5:
      return static_cast<double>(input.U8()) / 10;
    default: {
      const View text = input.TakeCounted();
      return std::string(text.begin(), text.end()).substr(0, history::kLongestText);
    }
  }
}

void ThereAndBack(Input& input) {
  std::vector<Entry> entries;
  Millis time = 0;
  while (!input.empty()) {
    time += 1 + input.U8() * (input.U8() % 2 == 0 ? 1 : 1'000'000);
    entries.push_back({time, AnyEntryValue(input), Quality::OfWord(input.U8())});
  }
  if (entries.empty()) return;
  const auto back = DecodeChunk(EncodeChunk(entries));
  Require(back.has_value(), "a chunk of ours is one");
  Require(*back == entries, "what was kept comes back");
}

void FuzzHistoryChunk(View bytes) {
  Input input(bytes);
  switch (input.Below(3)) {
    case 0:
      DecodeAny(input.Rest());
      break;
    case 1:
      DecodeAny(Packed(input));
      break;
    default:
      ThereAndBack(input);
      break;
  }
}

const Registered kHistoryChunk("history_chunk", FuzzHistoryChunk);

}  // namespace
}  // namespace baudgate::fuzz
