// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/open_rows.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "gateway/records/history/chunk.h"

namespace baudgate::history {
namespace {

enum Kind : std::uint8_t { kNothing, kFlag, kWhole, kCounter, kReal, kText };

}  // namespace

void OpenRows::Add(const Sample& sample) {
  if (sample.point >= current_.size()) current_.resize(sample.point + 1);
  Series& series = current_[sample.point];
  const Entry& entry = sample.entry;
  const bool fits = entry.time - series.begin <= Millis{~std::uint32_t{0}};
  if (!series.rows.empty() &&
      (series.run != sample.run || series.rows.size() == kMostInChunk || !fits)) {
    full_.push_back(std::move(series));
    series = {};
  }
  if (series.rows.empty()) {
    series.point = sample.point;
    series.run = sample.run;
    series.begin = entry.time;
  }
  Row row;
  row.after = static_cast<std::uint32_t>(entry.time - series.begin);
  if (!series.rows.empty() && row.after <= series.rows.back().after) return;
  if (entry.time < series.begin || entry.time <= 0) return;
  row.quality = entry.quality.word();
  row.kind = static_cast<std::uint8_t>(entry.value.index());
  if (const auto* flag = std::get_if<bool>(&entry.value)) {
    row.bits = *flag ? 1 : 0;
  } else if (const auto* whole = std::get_if<std::int64_t>(&entry.value)) {
    row.bits = static_cast<std::uint64_t>(*whole);
  } else if (const auto* counter = std::get_if<std::uint64_t>(&entry.value)) {
    row.bits = *counter;
  } else if (const auto* number = std::get_if<double>(&entry.value)) {
    row.bits = std::bit_cast<std::uint64_t>(*number);
  } else if (const auto* text = std::get_if<std::string>(&entry.value)) {
    row.bits = series.texts.size();
    series.texts.push_back(text->substr(0, kLongestText));
  }
  series.rows.push_back(row);
  oldest_ = size_++ == 0 ? entry.time : std::min(oldest_, entry.time);
}

Entry OpenRows::EntryOf(const Series& series, const Row& row) {
  Entry entry{series.begin + Millis{row.after}, {}, Quality::OfWord(row.quality)};
  switch (row.kind) {
    case kFlag:
      entry.value = row.bits != 0;
      break;
    case kWhole:
      entry.value = static_cast<std::int64_t>(row.bits);
      break;
    case kCounter:
      entry.value = row.bits;
      break;
    case kReal:
      entry.value = std::bit_cast<double>(row.bits);
      break;
    case kText:
      entry.value = series.texts[row.bits];
      break;
    default:
      break;
  }
  return entry;
}

bool OpenRows::Pack(std::size_t entries, std::vector<Chunk>& out) {
  std::vector<Entry> unpacked;
  while (entries > 0 && (!full_.empty() || packed_ < current_.size())) {
    Series& series = full_.empty() ? current_[packed_] : full_.back();
    if (!series.rows.empty()) {
      unpacked.clear();
      for (const Row& row : series.rows) unpacked.push_back(EntryOf(series, row));
      Chunk chunk{series.point,
                  series.run,
                  unpacked.front().time,
                  unpacked.back().time,
                  static_cast<std::int64_t>(unpacked.size()),
                  EncodeChunk(unpacked)};
      if (chunk.bytes.empty()) return false;
      out.push_back(std::move(chunk));
      size_ -= series.rows.size();
      entries -= std::min(entries, series.rows.size());
      series = {};
    }
    if (full_.empty()) {
      ++packed_;
    } else {
      full_.pop_back();
    }
  }
  return true;
}

}  // namespace baudgate::history
