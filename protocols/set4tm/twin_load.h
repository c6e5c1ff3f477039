// A load profile of a simulated meter: a ring that fills with time, hours with headers, the pointer
// where the next slice will stand. What a slice counts follows from its begin alone.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/common/civil_zone.h"
#include "protocols/set4tm/load_profile.h"

namespace baudgate::protocols::set4tm {

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
