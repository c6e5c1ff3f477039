// The load profile of a meter: 8-byte records in a ring, each hour a header and 60/T slices
// (reference, chapter 11). A slice holds what was counted in T minutes; its time is its begin.
//
//   14 14 08 02 00 02 34 37    header: 14 h of 2002-08-14, summer, slices of 2 min, sum 34, spare
//   00 64 00 00 80 0A 00 00    slice: P+ 100, P- 0, Q+ 10 (incomplete), Q- 0
//   35 11 08 09 99 06 58       pointer: the slice of 11:35, 2099-09-08, will stand at 0658
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/common/civil_zone.h"
#include "protocols/conversation.h"
#include "protocols/set4tm/constants.h"

namespace baudgate::protocols::set4tm {

inline constexpr std::size_t kLoadRecord = 8;

struct LoadHeader {
  CivilZone::Civil begin{};  ///< of the hour, by the meter's clock
  bool summer = false;
  unsigned minutes = 30;  ///< of a slice

  std::size_t slices() const { return 60 / minutes; }
};
/// `record` has kLoadRecord bytes. Empty: it is no header: another sum, no such hour, or slices
/// that do not fill it. Zeros have a good sum, and are no date.
std::optional<LoadHeader> ParseLoadHeader(View record);
Bytes BytesOf(const LoadHeader& header);

/// The hour as UTC. The season tells which of two hours it is when the clock is set back.
CivilZone::Utc UtcOf(const LoadHeader& header, const CivilZone& zone);

/// P+, P-, Q+, Q-.
struct LoadSlice {
  struct Count {
    std::uint16_t pulses = 0;
    bool incomplete = false;  ///< the meter did not measure all the time
  };
  std::array<Count, 4> counts{};
};
LoadSlice ParseLoadSlice(View record);

/// Where the meter writes.
struct LoadPointer {
  CivilZone::Civil hour{};
  unsigned minute = 0;  ///< of the current slice, or within it
  bool wrapped = false;
  std::size_t address = 0;  ///< of the slice
};
std::optional<LoadPointer> ParseLoadPointer(View data);

/// Addresses of hours in a ring of so many bytes: an hour that does not fit in before its end
/// stands at 0 (reference, chapter 11).
struct LoadRing {
  std::size_t bytes = 65536;
  unsigned minutes = 30;

  std::size_t block() const { return kLoadRecord * (1 + 60 / minutes); }
  std::size_t hours() const { return bytes / block(); }
  std::size_t Next(std::size_t address) const {
    return address + 2 * block() > bytes ? 0 : address + block();
  }
  /// An hour that is being written: the address of its header, and how many of its slices are over.
  struct Hour {
    std::size_t address = 0;
    std::size_t finished = 0;
  };
  /// The hour that is being written, if the pointer names the place of a slice in it. Empty: no
  /// slice can stand at that address.
  std::optional<Hour> HourOf(const LoadPointer& pointer) const;
  /// The same if the pointer names the place behind the last record, because the header of the hour
  /// is not written yet.
  std::optional<Hour> HourBehind(const LoadPointer& pointer) const;
};

/// "load_1", "load_2".
std::string NameOfLoad(unsigned profile);
/// Mean powers in kW and kvar, N / (2 A) · 60 / T · Kn · Kt; a slice that is incomplete is
/// uncertain. `scale` knows the factor of energy.
PastRecord RecordOf(unsigned profile, const LoadHeader& header, std::size_t slice,
                    const LoadSlice& counts, const CivilZone& zone, const Scale& scale);

}  // namespace baudgate::protocols::set4tm
