// The archive of a simulated meter: energy registers at the beginning of months and days, which are
// computed from the date alone, journals (TwinJournals) and load profiles (TwinLoad).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/common/clock.h"
#include "protocols/conversation.h"
#include "protocols/set4tm/archive/load_profile.h"

namespace baudgate::protocols::set4tm {

/// Returns the counts of A+, A-, R+, R- at the beginning of the day, for all tariffs (0) or one.
std::array<std::uint32_t, 4> TwinCounts(std::chrono::local_days begin, unsigned tariff);

/// Returns the reply to 0A 83, 84 or 86 at the meter's time `now`. Empty: `pdu` is another request.
std::optional<Bytes> TwinRegisters(View pdu, CivilZone::Civil now);

// The journals of a simulated meter: the last records of each, the newest at the last place.
class TwinJournals {
 public:
  TwinJournals(const CivilZone& zone, std::size_t records) : zone_(zone), most_(records) {}

  /// Adds an event by the codes in archive/journals.h. Returns false if no such journal exists.
  bool Raise(const DeviceEvent& event, WallTime now);
  /// Returns the requested record; zeros if its place is empty. Nothing: no event was raised in
  /// this journal, or `pdu` asks for no journal.
  std::optional<Bytes> Record(View pdu) const;
  /// True if the meter has this record, even an empty one.
  bool Has(View pdu) const;

 private:
  CivilZone zone_;
  std::size_t most_;
  std::map<std::uint8_t, std::deque<Bytes>> journals_;
};

// A load profile of a simulated meter: a ring of hours with headers that fills with time. The
// pointer is the place of the next slice. The counts of a slice follow from its beginning alone.
class TwinLoad {
 public:
  using Utc = CivilZone::Utc;

  /// The memory is empty at first. The meter has been on since `begin`.
  TwinLoad(const CivilZone& zone, unsigned minutes, std::size_t bytes, Utc begin);

  /// From the next hour on each header is written with the first slice of its hour. Until then the
  /// pointer names the place after the last record.
  void WriteHeadersLate() { late_ = true; }
  /// Writes all slices that have ended before `now`.
  void Advance(Utc now);
  /// Simulates a power failure while the clock runs on. Whole hours without power are missing from
  /// the memory; other slices without power are incomplete.
  void PowerOff(Utc from, Utc to);

  unsigned minutes() const { return ring_.minutes; }
  Bytes Pointer() const;
  std::optional<Bytes> Memory(std::size_t address, std::size_t count) const;

  /// Returns P+, P-, Q+, Q- of the slice that begins at `begin`.
  static std::array<std::uint16_t, 4> PulsesOf(Utc begin);

 private:
  void BeginHour();
  void WriteHeader();
  void Write(std::size_t address, View record);
  void Finish(bool powered);
  std::chrono::minutes span() const { return std::chrono::minutes(ring_.minutes); }

  CivilZone zone_;
  LoadRing ring_;
  Bytes memory_;
  Utc slice_;                 // begin of the slice under way
  std::size_t hour_ = 0;      // address of the header of the hour under way
  std::size_t finished_ = 0;  // finished slices of the hour
  bool incomplete_ = false;   // the slice under way is incomplete
  bool wrapped_ = false;
  bool late_ = false;    // see WriteHeadersLate
  bool headed_ = false;  // the header of the hour is written
};

}  // namespace baudgate::protocols::set4tm
