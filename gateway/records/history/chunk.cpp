// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/chunk.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace baudgate::history {

void ColumnWriter::Unsigned(std::uint64_t number) {
  for (; number > 0x7F; number >>= 7U) {
    bytes_.push_back(static_cast<std::uint8_t>((number & 0x7FU) | 0x80U));
  }
  bytes_.push_back(static_cast<std::uint8_t>(number));
}

void ColumnWriter::Text(const std::string& text) {
  Unsigned(text.size());
  Append(bytes_, text);
}

std::uint64_t ColumnReader::Unsigned() {
  std::uint64_t number = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    if (!ok_ || rest_.empty()) break;
    const std::uint8_t byte = rest_.front();
    rest_ = rest_.subspan(1);
    number |= std::uint64_t{byte & 0x7FU} << shift;
    if ((byte & 0x80U) == 0) return number;
  }
  ok_ = false;
  return 0;
}

std::string ColumnReader::Text() {
  const std::uint64_t size = Unsigned();
  if (!ok_ || size > rest_.size()) {
    ok_ = false;
    return {};
  }
  const auto text = AsText(rest_.first(size));
  rest_ = rest_.subspan(size);
  return std::string(text);
}

namespace {

constexpr std::array<double, 7> kPowers = {1, 10, 100, 1e3, 1e4, 1e5, 1e6};
constexpr std::array<double, 7> kScales = {1, 0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-6};
/// Above this limit, a double cannot represent every tenth, so the forms `divided` and `scaled` are
/// not used.
constexpr double kMostWhole = 1e15;

bool IsSame(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

double Number(ValueForm form, std::int64_t whole) {
  const auto number = static_cast<double>(whole);
  return form.code == ValueCode::divided ? number / kPowers[form.decimals]
                                         : number * kScales[form.decimals];
}

/// Returns the whole number that stands for `number` in this form (ValueCode::divided or scaled);
/// empty: the whole number would not restore `number` exactly.
std::optional<std::int64_t> WholeOf(ValueForm form, double number) {
  const double whole = number * kPowers[form.decimals];
  if (!(std::abs(whole) < kMostWhole)) return std::nullopt;
  const auto rounded = static_cast<std::int64_t>(std::llround(whole));
  if (!IsSame(Number(form, rounded), number)) return std::nullopt;
  return rounded;
}

bool Fits(ValueForm form, std::span<const Value> values) {
  return std::ranges::all_of(values, [&](const Value& value) {
    return WholeOf(form, std::get<double>(value)).has_value();
  });
}

bool IsSingle(const Value& value) {
  const double number = std::get<double>(value);
  if (!(std::abs(number) <= std::numeric_limits<float>::max())) return false;
  return IsSame(static_cast<double>(static_cast<float>(number)), number);
}

ValueForm FormOfDoubles(std::span<const Value> values) {
  for (std::uint8_t decimals = 0; decimals < kPowers.size(); ++decimals) {
    for (const ValueCode code : {ValueCode::divided, ValueCode::scaled}) {
      if (Fits({code, decimals}, values)) return {code, decimals};
    }
  }
  return {std::ranges::all_of(values, IsSingle) ? ValueCode::single : ValueCode::real, 0};
}

ValueCode CodeOf(const Value& value) {
  constexpr std::array<ValueCode, 6> kCodes = {ValueCode::none,  ValueCode::flag,
                                               ValueCode::whole, ValueCode::counter,
                                               ValueCode::real,  ValueCode::text};
  return kCodes[value.index()];
}

/// Returns the number that represents the value in its column, where only differences are written.
/// Must not be called for texts.
std::int64_t BitsOf(ValueForm form, const Value& value) {
  switch (form.code) {
    case ValueCode::flag:
      return std::get<bool>(value) ? 1 : 0;
    case ValueCode::whole:
      return std::get<std::int64_t>(value);
    case ValueCode::counter:
      return static_cast<std::int64_t>(std::get<std::uint64_t>(value));
    case ValueCode::divided:
    case ValueCode::scaled:
      return WholeOf(form, std::get<double>(value)).value_or(0);
    case ValueCode::single:
      return std::bit_cast<std::int32_t>(static_cast<float>(std::get<double>(value)));
    default:
      return std::bit_cast<std::int64_t>(std::get<double>(value));
  }
}

Value ValueOf(ValueForm form, std::int64_t bits) {
  switch (form.code) {
    case ValueCode::flag:
      return bits != 0;
    case ValueCode::whole:
      return bits;
    case ValueCode::counter:
      return static_cast<std::uint64_t>(bits);
    case ValueCode::divided:
    case ValueCode::scaled:
      return Number(form, bits);
    case ValueCode::single:
      return static_cast<double>(std::bit_cast<float>(static_cast<std::int32_t>(bits)));
    default:
      return std::bit_cast<double>(bits);
  }
}

bool IsKnown(ValueForm form) {
  return form.code > ValueCode::none && form.code <= ValueCode::mixed &&
         form.decimals < kPowers.size();
}

void WriteValues(ValueForm form, std::span<const Value> values, ColumnWriter& to) {
  std::int64_t before = 0;
  for (const Value& value : values) {
    ValueForm its = form;
    if (form.code == ValueCode::mixed) {
      its.code = CodeOf(value);
      to.Unsigned(static_cast<std::uint64_t>(its.code));
      before = 0;
    }
    if (its.code == ValueCode::text) {
      to.Text(std::get<std::string>(value));
      continue;
    }
    const std::int64_t bits = BitsOf(its, value);
    to.Signed(WrapSub(bits, before));
    before = bits;
  }
}

std::vector<Value> ReadValues(ValueForm form, std::size_t count, ColumnReader& from) {
  std::vector<Value> values;
  if (count > 0 && !IsKnown(form)) from.Fail();
  std::int64_t before = 0;
  while (from.ok() && values.size() < count) {
    ValueForm its = form;
    if (form.code == ValueCode::mixed) {
      its.code = static_cast<ValueCode>(std::min<std::uint64_t>(from.Unsigned(), 255));
      before = 0;
      if (!IsKnown(its) || its.code == ValueCode::mixed) from.Fail();
    }
    if (its.code == ValueCode::text) {
      values.emplace_back(from.Text());
    } else {
      before = WrapAdd(before, from.Signed());
      values.push_back(ValueOf(its, before));
    }
  }
  return values;
}

}  // namespace

ValueForm FormOf(std::span<const Value> values) {
  if (values.empty()) return {};
  const ValueCode code = CodeOf(values.front());
  const bool alike =
      std::ranges::all_of(values, [&](const Value& value) { return CodeOf(value) == code; });
  if (!alike) return {ValueCode::mixed, 0};
  return code == ValueCode::real ? FormOfDoubles(values) : ValueForm{code, 0};
}

namespace {

constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kHead = 3;
/// The limit of a chunk's size before compression, in bytes: more than kMostInChunk texts of
/// kLongestText.
constexpr std::size_t kMostBytes = 8'000'000;
constexpr Millis kLastTime = 7'300'000'000'000;  // in the year 2201; FormatWallTime can print it

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
