// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/chunk.h"

#include <zlib.h>

#include "gateway/records/history/columns.h"
#include "gateway/records/history/value_column.h"

namespace baudgate::history {
namespace {

constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kHead = 3;
/// kMostInChunk texts of kLongestText, with room.
constexpr std::size_t kMostBytes = 8'000'000;
constexpr Millis kLastTime = 7'300'000'000'000;  // in 2201; FormatWallTime knows it

/// How many in a row agree in something: (n, x), (n, x), …
template <typename Of>
void WriteRuns(std::span<const Entry> entries, ColumnWriter& to, Of of) {
  for (std::size_t i = 0; i < entries.size();) {
    std::size_t end = i + 1;
    while (end < entries.size() && of(entries[end]) == of(entries[i])) ++end;
    to.Unsigned(end - i);
    to.Unsigned(of(entries[i]));
    i = end;
  }
}

template <typename Put>
void ReadRuns(std::vector<Entry>& entries, ColumnReader& from, Put put) {
  for (std::size_t i = 0; i < entries.size();) {
    const std::uint64_t count = from.Unsigned();
    const std::uint64_t what = from.Unsigned();
    if (count == 0 || count > entries.size() - i) from.Fail();
    if (!from.ok()) return;
    for (const std::size_t end = i + count; i < end; ++i) put(entries[i], what);
  }
}

void WriteTimes(std::span<const Entry> entries, ColumnWriter& to) {
  to.Unsigned(entries.size());
  Millis before = 0;
  Millis step = 0;
  for (const Entry& entry : entries) {
    const Millis its = entry.time - before;
    to.Signed(its - step);
    step = before == 0 ? 0 : its;
    before = entry.time;
  }
}

std::vector<Entry> ReadTimes(ColumnReader& from) {
  const std::uint64_t count = from.Unsigned();
  if (count == 0 || count > kMostInChunk) from.Fail();
  std::vector<Entry> entries;
  Millis before = 0;
  Millis step = 0;
  while (from.ok() && entries.size() < count) {
    const Millis its = WrapAdd(from.Signed(), step);
    const Millis time = WrapAdd(before, its);
    if (time <= before || time > kLastTime) from.Fail();
    entries.push_back({.time = time});
    step = before == 0 ? 0 : its;
    before = time;
  }
  return entries;
}

}  // namespace

Bytes EncodeChunk(std::span<const Entry> entries) {
  std::vector<Value> values;
  for (const Entry& entry : entries) {
    if (HasValue(entry.value)) values.push_back(entry.value);
  }
  const ValueForm form = FormOf(values);
  ColumnWriter plain;
  WriteTimes(entries, plain);
  WriteRuns(entries, plain, [](const Entry& entry) { return std::uint64_t{entry.quality.word()}; });
  WriteRuns(entries, plain,
            [](const Entry& entry) { return std::uint64_t{HasValue(entry.value) ? 1U : 0U}; });
  WriteValues(form, values, plain);

  ColumnWriter head;
  head.Unsigned(plain.bytes().size());
  Bytes chunk = {kVersion, static_cast<std::uint8_t>(form.code), form.decimals};
  Append(chunk, View(head.bytes()));
  const std::size_t begin = chunk.size();
  uLongf size = compressBound(static_cast<uLong>(plain.bytes().size()));
  chunk.resize(begin + size);
  const int code = compress2(chunk.data() + begin, &size, plain.bytes().data(),
                             static_cast<uLong>(plain.bytes().size()), Z_DEFAULT_COMPRESSION);
  if (code != Z_OK) return {};
  chunk.resize(begin + size);
  return chunk;
}

std::optional<std::vector<Entry>> DecodeChunk(View bytes) {
  if (bytes.size() <= kHead || bytes[0] != kVersion) return std::nullopt;
  const ValueForm form{static_cast<ValueCode>(bytes[1]), bytes[2]};
  ColumnReader head(bytes.subspan(kHead));
  const std::uint64_t plain_size = head.Unsigned();
  if (!head.ok() || plain_size > kMostBytes) return std::nullopt;
  ColumnWriter again;
  again.Unsigned(plain_size);
  const std::size_t begin = kHead + again.bytes().size();
  if (begin > bytes.size()) return std::nullopt;
  Bytes plain(plain_size);
  uLongf size = static_cast<uLongf>(plain_size);
  const View packed = bytes.subspan(begin);
  const int code =
      uncompress(plain.data(), &size, packed.data(), static_cast<uLong>(packed.size()));
  if (code != Z_OK || size != plain_size) return std::nullopt;

  ColumnReader from(plain);
  std::vector<Entry> entries = ReadTimes(from);
  if (!from.ok()) return std::nullopt;
  ReadRuns(entries, from, [](Entry& entry, std::uint64_t word) {
    entry.quality = Quality::OfWord(static_cast<std::uint16_t>(word));
  });
  std::vector<Entry*> with_value;
  ReadRuns(entries, from, [&](Entry& entry, std::uint64_t has) {
    if (has != 0) with_value.push_back(&entry);
  });
  std::vector<Value> values = ReadValues(form, with_value.size(), from);
  if (!from.ok() || !from.at_end() || values.size() != with_value.size()) return std::nullopt;
  for (std::size_t i = 0; i < values.size(); ++i) with_value[i]->value = std::move(values[i]);
  return entries;
}

}  // namespace baudgate::history
