// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/register_image.h"

#include <algorithm>
#include <type_traits>

#include "gateway/outputs/modbus/registers/register_contents.h"

namespace baudgate::modbus {
namespace {

template <typename Word>
ExceptionCode FillOne(const bus::DeviceRecord& record, Area area, const Span& span, Instant now,
                      std::span<Word> out) {
  const Piece piece{area, span.point, 0, span.count};
  if constexpr (std::is_same_v<Word, std::uint8_t>) {
    if (area == Area::value) return FillBit(record, span.point, now, false, out.front());
    return FillBits(record, std::span(&piece, 1), now, out);
  } else {
    return FillRegisters(record, std::span(&piece, 1), now, out);
  }
}

template <typename Word>
ExceptionCode CopyFrom(const TableImage<Word>& table, const RegisterImage::Place& place,
                       std::span<Word> out) {
  out = out.first(place.count);
  if (place.area == Area::value) return table.CopyValues(place.at, out);
  table.CopyQualities(place.at, out);
  return kNoException;
}

}  // namespace

template <typename Word>
TableImage<Word>::TableImage(const UnitMap& unit, config::Table table) {
  std::size_t size = 0;
  for (const Span& span : unit.spans(table)) {
    if (!span.readable) continue;
    if (runs_.empty() || runs_.back().end != span.start) {
      runs_.push_back({span.start, span.start, size});
    }
    runs_.back().end = span.end();
    begins_.resize(size + span.count);
    begins_[size] = 1;
    size += span.count;
    spans_.push_back(span);
  }
  begins_.push_back(1);
  values_.resize(size);
  qualities_.resize(size);
  withheld_.resize(size + 1);
}

template <typename Word>
std::optional<std::size_t> TableImage<Word>::FindQualities(std::uint32_t start,
                                                           std::size_t count) const {
  const auto after = std::ranges::upper_bound(runs_, start, {}, &Run::start);
  if (after == runs_.begin()) return std::nullopt;
  const Run& run = *std::prev(after);
  if (start >= run.end || count > run.end - start) return std::nullopt;
  return run.at + (start - run.start);
}

template <typename Word>
std::optional<std::size_t> TableImage<Word>::FindValues(std::uint32_t start,
                                                        std::size_t count) const {
  const auto at = FindQualities(start, count);
  if (!at || begins_[*at] == 0 || begins_[*at + count] == 0) return std::nullopt;
  return at;
}

template <typename Word>
void TableImage<Word>::Fill(const bus::DeviceRecord& record, Instant now) {
  std::size_t at = 0;
  std::uint32_t withheld = 0;
  for (const Span& span : spans_) {
    const auto values = std::span(values_).subspan(at, span.count);
    const auto shown = FillOne<Word>(record, Area::value, span, now, values);
    FillOne<Word>(record, Area::quality, span, now, std::span(qualities_).subspan(at, span.count));
    for (std::size_t i = 0; i < span.count; ++i) {
      if (shown != kNoException) ++withheld;
      withheld_[++at] = withheld;
    }
  }
}

template <typename Word>
ExceptionCode TableImage<Word>::CopyValues(std::size_t at, std::span<Word> out) const {
  if (withheld_[at] != withheld_[at + out.size()]) return kNoTarget;
  std::copy_n(values_.data() + at, out.size(), out.data());
  return kNoException;
}

template <typename Word>
void TableImage<Word>::CopyQualities(std::size_t at, std::span<Word> out) const {
  std::copy_n(qualities_.data() + at, out.size(), out.data());
}

RegisterImage::RegisterImage(const UnitMap& unit)
    : registers_(unit, config::Table::registers), bits_(unit, config::Table::bits) {}

std::optional<RegisterImage::Place> RegisterImage::Find(config::Table table, std::uint32_t start,
                                                        std::size_t count) const {
  const auto find = [&](const auto& words) -> std::optional<Place> {
    const bool quality = start >= kQualityOffset;
    const auto at = quality ? words.FindQualities(start - kQualityOffset, count)
                            : words.FindValues(start, count);
    if (!at) return std::nullopt;
    return Place{table, quality ? Area::quality : Area::value, *at, count};
  };
  if (table != config::Table::bits) return find(registers_);
  // A read of one bit can fail with kNoTarget where a read of several bits does not (see FillBit in
  // gateway/outputs/modbus/registers/register_contents.h), so it bypasses the image.
  return count == 1 && start < kQualityOffset ? std::nullopt : find(bits_);
}

bool RegisterImage::Refresh(const bus::DeviceRecord& record, Instant now, std::size_t asked) {
  if (version_ == record.version && now >= valid_from_ && now < valid_until_) return true;
  asked_ += asked;
  if (asked_ < registers_.size() + bits_.size()) return false;
  asked_ = 0;
  registers_.Fill(record, now);
  bits_.Fill(record, now);
  version_ = record.version;
  valid_from_ = now;
  valid_until_ = Instant::max();
  for (std::size_t point = 0; point < record.points.size(); ++point) {
    if (const auto due = NextAgeing(record, point, now)) {
      valid_until_ = std::min(valid_until_, *due);
    }
  }
  return true;
}

ExceptionCode RegisterImage::Copy(const Place& place, std::span<std::uint16_t> out) const {
  return CopyFrom(registers_, place, out);
}

ExceptionCode RegisterImage::Copy(const Place& place, std::span<std::uint8_t> out) const {
  return CopyFrom(bits_, place, out);
}

template class TableImage<std::uint16_t>;
template class TableImage<std::uint8_t>;

}  // namespace baudgate::modbus
