// The journals of a meter: which there are, how a record is laid out, and what events it tells
// (reference, 8.2). Times are the meter's local ones, without a zone.
//
//   journal 07, 31 30 15 01 02 09 02 · 00 00 00 00 00 00 00    E71 2002-09-02T15:30:31, not over
//   yet … 31 30 15 01 02 09 02 · 12 32 15 01 02 09 02              E71, E72 2002-09-02T15:32:12 …
//   99 30 15 …                                               E0, the bytes in hex
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "protocols/common/civil_zone.h"
#include "protocols/conversation.h"

namespace baudgate::protocols::set4tm {

struct Journal {
  enum class Kind : std::uint8_t {
    interval,    ///< begin and end
    correction,  ///< the clock before and behind it
    moment,      ///< one time
    status,      ///< a time, two bytes in reserve, the status word
  };
  std::uint8_t number = 0;
  Kind kind = Kind::interval;
  bool urgent = false;  ///< read before others
  std::string_view name{};
};

/// Those whose records the reference lays out; the urgent ones first.
std::span<const Journal> Journals();

/// 10 · journal + 1 for what begins, or has happened; + 2 for its end.
constexpr std::uint32_t BeginCode(const Journal& journal) { return journal.number * 10U + 1; }
constexpr std::uint32_t EndCode(const Journal& journal) { return journal.number * 10U + 2; }
/// Records may be missing.
constexpr std::uint32_t GapCode(const Journal& journal) { return journal.number * 10U + 9; }

/// Asks for one record, 0 being the oldest: 04 where that can name it, else 09.
Bytes JournalRequest(const Journal& journal, std::size_t record);
/// Nothing was written here yet: all zeros, or all ones (inferred).
bool IsEmpty(View record);
/// `record` is what `before` has become: what was under way has ended.
bool HasEnded(View before, View record);

struct JournalReader {
  std::optional<CivilZone> zone{};  ///< empty: events have no time, and their texts the civil one
  bool knows_status = false;        ///< the bits of the status word are those of the reference
  /// `before`: the record as it was when its events were taken; empty: none were.
  std::vector<DeviceEvent> EventsOf(const Journal& journal, View record, View before) const;

 private:
  DeviceEvent At(std::uint32_t code, CivilZone::Civil civil, std::string text) const;
};

}  // namespace baudgate::protocols::set4tm
