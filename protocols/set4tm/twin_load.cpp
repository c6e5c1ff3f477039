// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/twin_load.h"

#include <algorithm>

#include "protocols/set4tm/civil_bcd.h"

namespace baudgate::protocols::set4tm {

using std::chrono::floor;
using std::chrono::hours;

TwinLoad::TwinLoad(const CivilZone& zone, unsigned minutes, std::size_t bytes, Utc begin)
    : zone_(zone), memory_(bytes), slice_(floor<hours>(begin)) {
  ring_.bytes = bytes;
  ring_.minutes = minutes;
  BeginHour();
}

std::array<std::uint16_t, 4> TwinLoad::PulsesOf(Utc begin) {
  const auto n = static_cast<std::uint64_t>(begin.time_since_epoch() / std::chrono::minutes(1));
  const auto some = [n](std::uint64_t factor) {
    return static_cast<std::uint16_t>((n * factor >> 3U) % 0x7FFF);
  };
  return {some(2'654'435'761U), some(40'503), some(69'069), some(1'103'515'245U)};
}

void TwinLoad::Write(std::size_t address, View record) {
  std::ranges::copy(record, memory_.begin() + static_cast<std::ptrdiff_t>(address));
}

void TwinLoad::BeginHour() {
  finished_ = 0;
  headed_ = false;
  if (!late_) WriteHeader();
}

void TwinLoad::WriteHeader() {
  const auto civil = zone_.ToCivil(floor<hours>(slice_));
  Write(hour_, BytesOf(LoadHeader{civil, zone_.IsDaylight(slice_), ring_.minutes}));
  headed_ = true;
}

/// The slice under way is over.
void TwinLoad::Finish(bool powered) {
  if (!headed_) WriteHeader();
  Bytes record;
  for (const std::uint16_t pulses : PulsesOf(slice_)) {
    const bool incomplete = incomplete_ || !powered;
    const unsigned word = (incomplete ? 0x8000U : 0U) | (powered ? pulses : 0U);
    Append(record, Bytes{static_cast<std::uint8_t>(word >> 8U), static_cast<std::uint8_t>(word)});
  }
  Write(hour_ + kLoadRecord * (1 + finished_), record);
  ++finished_;
  incomplete_ = false;
  slice_ += span();
  if (finished_ < 60 / ring_.minutes) return;
  const std::size_t next = ring_.Next(hour_);
  wrapped_ = wrapped_ || next < hour_;
  hour_ = next;
  BeginHour();
}

void TwinLoad::Advance(Utc now) {
  while (slice_ + span() <= now) Finish(true);
}

void TwinLoad::PowerOff(Utc from, Utc to) {
  Advance(from);
  incomplete_ = true;
  const Utc back = floor<hours>(to);
  if (floor<hours>(slice_) != back) {
    const Utc end = floor<hours>(slice_) + hours(1);
    while (slice_ < end) Finish(false);
    slice_ = back;
    BeginHour();
  }
  while (slice_ + span() <= to) Finish(false);
  incomplete_ = true;
}

Bytes TwinLoad::Pointer() const {
  const Bytes civil = BytesOf(zone_.ToCivil(slice_));
  const std::size_t address = hour_ + (headed_ ? kLoadRecord * (1 + finished_) : 0);
  return {static_cast<std::uint8_t>(civil[1] | (wrapped_ ? 0x80U : 0U)),
          civil[2],
          civil[4],
          civil[5],
          civil[6],
          static_cast<std::uint8_t>(address >> 8U),
          static_cast<std::uint8_t>(address & 0xFFU)};
}

std::optional<Bytes> TwinLoad::Memory(std::size_t address, std::size_t count) const {
  if (address + count > memory_.size()) return std::nullopt;
  const auto begin = memory_.begin() + static_cast<std::ptrdiff_t>(address);
  return Bytes(begin, begin + static_cast<std::ptrdiff_t>(count));
}

}  // namespace baudgate::protocols::set4tm
