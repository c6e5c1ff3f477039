// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/twin_journals.h"

#include <algorithm>

#include "protocols/set4tm/civil_bcd.h"
#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/journal.h"

namespace baudgate::protocols::set4tm {
namespace {

/// "reserve" and the status word, with E-01.
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

}  // namespace baudgate::protocols::set4tm
