// The archive of a simulated meter: energy registers at the beginning of months and days, which are
// computed from the date alone, journals (TwinJournals) and load profiles (TwinLoad).
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

/// Returns the counts of A+, A-, R+, R- at the beginning of a day. `tariff`: 0 for the sum of all
/// tariffs.
std::array<std::uint32_t, 4> TwinCounts(std::chrono::local_days begin, unsigned tariff);

/// Returns the reply to 0A 83, 84 or 86 at the meter's time `now`. Empty: `pdu` is another request.
std::optional<Bytes> TwinRegisters(View pdu, CivilZone::Civil now);

// The journals of a simulated meter. Each contains its last records, the newest at the last
// position.
class TwinJournals {
 public:
  TwinJournals(const CivilZone& zone, std::size_t records) : zone_(zone), most_(records) {}

  /// Adds a record for an event, whose codes are those of protocols/set4tm/archive/journals.h.
  /// Returns false if no journal has this code.
  bool Raise(const DeviceEvent& event, WallTime now);
  /// Returns the requested record, which is zeros if its position is empty. An empty optional: no
  /// event was raised in this journal, or `pdu` is not a request for a record.
  std::optional<Bytes> Record(View pdu) const;
  bool Has(View pdu) const;

 private:
  CivilZone zone_;
  std::size_t most_;
  std::map<std::uint8_t, std::deque<Bytes>> journals_;
};

// A load profile of a simulated meter: a ring of hours, each a header and slices, that fills with
// time. The pointer is the position of the next slice. The counts of a slice are computed from the
// time of its beginning.
class TwinLoad {
 public:
  using Utc = CivilZone::Utc;

  /// The memory is empty at first. `begin`: the time since which the meter has been on.
  TwinLoad(const CivilZone& zone, unsigned minutes, std::size_t bytes, Utc begin);

  /// From the next hour on, the header of an hour is written only together with its first slice.
  /// Before that the pointer names the position after the last record.
  void WriteHeadersLate() { late_ = true; }
  void Advance(Utc now);
  /// Simulates a power failure while the clock runs on. Whole hours without power are missing from
  /// the memory; other slices without power are incomplete.
  void PowerOff(Utc from, Utc to);

  unsigned minutes() const { return ring_.minutes; }
  Bytes Pointer() const;
  std::optional<Bytes> Memory(std::size_t address, std::size_t count) const;

  /// Returns the counts P+, P-, Q+, Q- of the slice that begins at `begin`.
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
  Utc slice_;
  std::size_t hour_ = 0;  // address of the header of the hour under way
  std::size_t finished_ = 0;
  bool incomplete_ = false;
  bool wrapped_ = false;
  bool late_ = false;
  bool headed_ = false;  // true: the header of the hour under way is written
};

}  // namespace baudgate::protocols::set4tm
