// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/journal.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "gateway/base/text.h"
#include "protocols/set4tm/civil_bcd.h"
#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/printed.h"

namespace baudgate::protocols::set4tm {
namespace {

using Kind = Journal::Kind;

constexpr std::size_t kStatusWord = 9;
/// The short form has four bits for each.
constexpr std::uint8_t kLastOfShortForm = 0x0A;
constexpr std::size_t kShortRecords = 16;

constexpr std::array<Journal, 9> kJournals = {{{0x01, Kind::interval, true, "power"},
                                               {0x07, Kind::interval, true, "phase 1"},
                                               {0x08, Kind::interval, true, "phase 2"},
                                               {0x09, Kind::interval, true, "phase 3"},
                                               {0x0A, Kind::interval, false, "terminal cover"},
                                               {0x3C, Kind::status, false, "status"},
                                               {0x02, Kind::correction, false, "clock"},
                                               {0x05, Kind::moment, false, "energy reset"},
                                               {0x06, Kind::moment, false, "profile 1"}}};

bool AllAre(View bytes, std::uint8_t value) {
  return std::ranges::all_of(bytes, [value](std::uint8_t byte) { return byte == value; });
}

std::string Written(CivilZone::Civil civil) {
  const WallTime wall(civil.time_since_epoch());
  return FormatWallTime(wall).substr(0, 19);
}

DeviceEvent Unread(const Journal& journal, View record) {
  return {0, 0, {}, fmt::format("journal {:02X}: {}", journal.number, ToHex(record))};
}

void Join(std::string& text, const std::string& more) {
  text += (text.empty() || more.empty() ? "" : ", ") + more;
}

}  // namespace

std::span<const Journal> Journals() { return kJournals; }

Bytes JournalRequest(const Journal& journal, std::size_t record) {
  const auto place = static_cast<std::uint8_t>(record);
  if (journal.number > kLastOfShortForm || record >= kShortRecords) {
    return {kJournalExtended, journal.number, place};
  }
  return {kJournal, static_cast<std::uint8_t>(unsigned{journal.number} << 4U | place)};
}

bool IsEmpty(View record) { return AllAre(record, 0x00) || AllAre(record, 0xFF); }

bool HasEnded(View before, View record) {
  if (before.size() != 2 * kCivilSize || record.size() != 2 * kCivilSize) return false;
  return std::ranges::equal(before.first(kCivilSize), record.first(kCivilSize)) &&
         AllAre(before.subspan(kCivilSize), 0) && !AllAre(record.subspan(kCivilSize), 0);
}

DeviceEvent JournalReader::At(std::uint32_t code, CivilZone::Civil civil, std::string text) const {
  if (!zone) {
    std::string shown = Written(civil) + " by its clock";
    Join(shown, text);
    return {0, code, {}, std::move(shown)};
  }
  const CivilZone::Moment moment = zone->ToUtc(civil);
  if (moment.fit == CivilZone::Fit::twice) Join(text, "or an hour earlier");
  if (moment.fit == CivilZone::Fit::never) Join(text, "its clock was not set to summer time");
  return {0, code, SaidTime{moment.utc.time_since_epoch(), {}}, std::move(text)};
}

std::vector<DeviceEvent> JournalReader::EventsOf(const Journal& journal, View record,
                                                 View before) const {
  const View first = record.first(std::min(kCivilSize, record.size()));
  const View second = record.subspan(first.size());
  const auto civil = CivilOf(first);
  const bool pair = journal.kind == Kind::interval || journal.kind == Kind::correction;
  const std::size_t length = journal.kind == Kind::moment ? kCivilSize : 2 * kCivilSize;
  const bool ended = pair && second.size() == kCivilSize && !AllAre(second, 0);
  const auto end = ended ? CivilOf(second) : std::nullopt;
  if (record.size() != length || !civil || (ended && !end)) return {Unread(journal, record)};
  switch (journal.kind) {
    case Kind::moment:
      return {At(BeginCode(journal), *civil, {})};
    case Kind::status: {
      const View word = record.subspan(kStatusWord);
      return {At(BeginCode(journal), *civil, knows_status ? FlagsOf(word) : ToHex(word))};
    }
    case Kind::correction: {
      if (!end) return {};
      const auto by = (*end - *civil).count();
      return {At(EndCode(journal), *end, fmt::format("by {:+} s", by))};
    }
    case Kind::interval:
      break;
  }
  std::vector<DeviceEvent> events;
  if (before.empty()) events.push_back(At(BeginCode(journal), *civil, {}));
  if (end) events.push_back(At(EndCode(journal), *end, {}));
  return events;
}

}  // namespace baudgate::protocols::set4tm
