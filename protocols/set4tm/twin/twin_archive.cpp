// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/twin/twin_archive.h"

#include <algorithm>

#include "protocols/set4tm/archive/journals.h"
#include "protocols/set4tm/meter/clock.h"
#include "protocols/set4tm/meter/codec.h"

namespace baudgate::protocols::set4tm {
namespace {

using std::chrono::local_days;
using std::chrono::months;
using std::chrono::year_month_day;

/// Returns the first day of the month with this number: in this year if the month has begun, else
/// in the last year.
std::optional<local_days> MonthOf(unsigned month, year_month_day today) {
  const year_month_day first = today.year() / std::chrono::month(month) / 1;
  if (!first.ok()) return std::nullopt;
  return local_days(std::chrono::month(month) > today.month() ? first - std::chrono::years(1)
                                                              : first);
}

std::optional<local_days> DayOf(unsigned day, year_month_day today) {
  if (day < 1 || day > 31) return std::nullopt;
  year_month_day date = today.year() / today.month() / std::chrono::day(day);
  while (!date.ok() || local_days(date) > local_days(today)) date -= months(1);
  return local_days(date);
}

}  // namespace

std::array<std::uint32_t, 4> TwinCounts(std::chrono::local_days begin, unsigned tariff) {
  const auto day = static_cast<std::uint32_t>(begin.time_since_epoch().count());
  const std::uint32_t base = day * 1000 + tariff * 100;
  return {base + 1, base + 2, base + 3, base + 4};
}

std::optional<Bytes> TwinRegisters(View pdu, CivilZone::Civil now) {
  constexpr std::uint8_t kAllEnergies = 0x0F;
  constexpr unsigned kTariffs = 8;
  if (pdu.size() != 6 || pdu[0] != kEnergyExtended || pdu[4] != kAllEnergies || pdu[3] > kTariffs) {
    return std::nullopt;
  }
  const year_month_day today(std::chrono::floor<std::chrono::days>(now));
  std::optional<local_days> begin;
  if (pdu[1] == 0x83) begin = MonthOf(pdu[2], today);
  if (pdu[1] == 0x84) begin = local_days(today);
  if (pdu[1] == 0x86) begin = DayOf(pdu[2], today);
  if (!begin) return std::nullopt;
  Bytes data;
  for (const std::uint32_t count : TwinCounts(*begin, pdu[3])) {
    for (unsigned shift = 32; shift > 0; shift -= 8) {
      data.push_back(static_cast<std::uint8_t>(count >> (shift - 8)));
    }
  }
  return data;
}

namespace {

/// Content of a status record: two reserved bytes and a status word with the flag E-01.
constexpr std::uint8_t kBatteryLow[kCivilSize] = {0, 0, 0x01, 0, 0, 0, 0};
constexpr std::chrono::seconds kCorrection(10);

struct Asked {
  std::uint8_t journal = 0;
  std::size_t record = 0;
};
std::optional<Asked> Parse(View pdu) {
  if (pdu.size() == 2 && pdu[0] == kJournal) {
    return Asked{static_cast<std::uint8_t>(pdu[1] >> 4U), pdu[1] & 0x0FU};
  }
  if (pdu.size() == 3 && pdu[0] == kJournalExtended) return Asked{pdu[1], pdu[2]};
  return std::nullopt;
}

}  // namespace

bool TwinJournals::Raise(const DeviceEvent& event, WallTime now) {
  const auto journal = std::ranges::find_if(Journals(), [&event](const Journal& one) {
    return event.code == BeginCode(one) || event.code == EndCode(one);
  });
  if (journal == Journals().end()) return false;
  const auto civil = zone_.ToCivil(std::chrono::floor<std::chrono::seconds>(now));
  const Bytes time = BytesOf(civil);
  auto& records = journals_[journal->number];
  const bool ends = journal->kind == Journal::Kind::interval && event.code == EndCode(*journal);
  if (ends && !records.empty() && IsEmpty(View(records.back()).subspan(kCivilSize))) {
    std::ranges::copy(time, records.back().begin() + kCivilSize);
    return true;
  }
  const bool corrects = journal->kind == Journal::Kind::correction;
  Bytes record = corrects ? BytesOf(civil - kCorrection) : time;
  if (ends || corrects) Append(record, time);
  if (journal->kind == Journal::Kind::status) Append(record, kBatteryLow);
  if (journal->kind != Journal::Kind::moment) record.resize(2 * kCivilSize);
  records.push_back(std::move(record));
  if (records.size() > most_) records.pop_front();
  return true;
}

bool TwinJournals::Has(View pdu) const {
  const auto asked = Parse(pdu);
  return asked && asked->record < most_ &&
         std::ranges::any_of(Journals(),
                             [&asked](const Journal& one) { return one.number == asked->journal; });
}

std::optional<Bytes> TwinJournals::Record(View pdu) const {
  const auto asked = Parse(pdu);
  if (!asked) return std::nullopt;
  const auto journal = journals_.find(asked->journal);
  if (journal == journals_.end() || asked->record >= most_) return std::nullopt;
  const std::size_t empty = most_ - journal->second.size();
  if (asked->record < empty) return Bytes(journal->second.front().size());
  return journal->second[asked->record - empty];
}

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

/// Ends the slice under way and writes its record into the memory. `powered`: whether the meter had
/// power.
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
