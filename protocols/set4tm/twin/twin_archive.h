// What a simulated meter keeps of its energies: registers at the begin of months and days, which
// follow from that begin alone. TwinJournals and TwinLoad are the journals and the load profiles of
// the twin.
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

/// Counts of A+, A-, R+, R- at the begin of that day, of all tariffs (0) or one.
std::array<std::uint32_t, 4> TwinCounts(std::chrono::local_days begin, unsigned tariff);

/// The reply to 0A 83, 84 or 86 at that time by the meter's clock; empty: that is another
/// request.
std::optional<Bytes> TwinRegisters(View pdu, CivilZone::Civil now);

// The journals of a simulated meter: the last records of each, the newest at the last place.
class TwinJournals {
 public:
  TwinJournals(const CivilZone& zone, std::size_t records) : zone_(zone), most_(records) {}

  /// By the codes of protocols/set4tm/archive/journals.h. False: there is no such journal.
  bool Raise(const DeviceEvent& event, WallTime now);
  /// The record that `pdu` asks for, zeros where it holds none; empty: nothing of this journal
  /// has happened here, or it is none.
  std::optional<Bytes> Record(View pdu) const;
  /// The meter keeps such a record, if only an empty one.
  bool Has(View pdu) const;

 private:
  CivilZone zone_;
  std::size_t most_;
  std::map<std::uint8_t, std::deque<Bytes>> journals_;
};

// A load profile of a simulated meter: a ring that fills with time, hours with headers, the pointer
// where the next slice will stand. What a slice counts follows from its begin alone.
class TwinLoad {
 public:
  using Utc = CivilZone::Utc;

  /// Its memory is empty, and the meter on since `begin`.
  TwinLoad(const CivilZone& zone, unsigned minutes, std::size_t bytes, Utc begin);

  /// From the next hour on its header is written with the first slice: until then the pointer names
  /// the place behind the last record.
  void WriteHeadersLate() { late_ = true; }
  /// Writes what is over by now.
  void Advance(Utc now);
  /// The meter is without power, and its clock runs on: hours that it misses whole are not in its
  /// memory, what it misses of others is incomplete.
  void PowerOff(Utc from, Utc to);

  unsigned minutes() const { return ring_.minutes; }
  Bytes Pointer() const;
  std::optional<Bytes> Memory(std::size_t address, std::size_t count) const;

  /// P+, P-, Q+, Q- of the slice that begins then.
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
  Utc slice_;                 // that is under way
  std::size_t hour_ = 0;      // address of its header
  std::size_t finished_ = 0;  // slices of the hour
  bool incomplete_ = false;   // the slice under way
  bool wrapped_ = false;
  bool late_ = false;    // see WriteHeadersLate
  bool headed_ = false;  // the hour has its header
};

}  // namespace baudgate::protocols::set4tm
