// The load profile of a meter: 8-byte records in a ring, each hour a header and 60/T slices
// (reference, chapter 11). A slice holds what was counted in T minutes; its time is its begin.
//
//   14 14 08 02 00 02 34 37    header: 14 h of 2002-08-14, summer, slices of 2 min, sum 34, spare
//   00 64 00 00 80 0A 00 00    slice: P+ 100, P- 0, Q+ 10 (incomplete), Q- 0
//   35 11 08 09 99 06 58       pointer: the slice of 11:35, 2099-09-08, will stand at 0658
//
// MemoryRead reads a stretch of memory piece by piece, and LoadReader decides which stretches.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "protocols/common/clock.h"
#include "protocols/conversation.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

// Stretches of a meter's memory, read piece by piece, no piece longer than a reply of it can be.
// Where replies do not say to which request they belong, all is read twice, the second time from
// the last piece to the first, and counts only if both are alike.
//
//   {0658, 24} in pieces of 16      0658 16 · 0668 8      and again: 0668 8 · 0658 16
class MemoryRead {
 public:
  struct Stretch {
    std::size_t address = 0;
    std::size_t count = 0;
  };
  /// `most`: bytes of a piece.
  MemoryRead(const std::vector<Stretch>& stretches, std::size_t most, bool twice);

  /// While it is not done.
  Stretch Next() const;
  /// The bytes of Next.
  void OnPiece(View bytes);
  bool done() const { return done_; }
  /// When done, one stretch behind the other; empty: the two readings differ.
  const Bytes& bytes() const { return bytes_; }

 private:
  std::vector<Stretch> pieces_;
  const bool twice_;
  std::vector<Bytes> read_;  // by piece
  std::size_t count_ = 0;    // pieces that were read, of both passes
  bool differs_ = false;
  bool done_ = false;
  Bytes bytes_;
};

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

// Reads one load profile on from where its history ends: which bytes of the ring to ask for, and
// what records they are. Nothing is asked by time alone: each reading begins with the header of the
// hour that was read last. As long as that is what it was, the hours behind it are the next ones,
// because the ring overwrites it first; if not, the ring went round (or was cleared), and reading
// goes on with the oldest hour that is there.
//
//   place 0658, header 14 14 08 02 …, 2 taken     read 24 bytes there and 24 at 0670: two records
//                                                 of 15 h; place 0670, …, 2

/// The hour that was read last, and how many of its slices: "0658:1414080200023437:30".
struct LoadPlace {
  std::size_t address = 0;
  Bytes header{};
  std::size_t taken = 0;

  std::string Text() const;
  static std::optional<LoadPlace> Parse(std::string_view text);
};

class LoadReader {
 public:
  /// What a reply of this meter can hold, and whether replies belong to their requests for certain.
  struct Manner {
    std::size_t most = 16;
    bool twice = true;
  };
  enum class Step { interval, pointer, memory };

  LoadReader(unsigned profile, const CivilZone& zone, std::size_t bytes)
      : profile_(profile), zone_(zone) {
    ring_.bytes = bytes;
  }

  unsigned profile() const { return profile_; }
  /// Where its history ends, as was kept; empty: it has none. Of `another` meter only the time
  /// counts: its history goes on with what is later.
  void OnKept(std::optional<LoadPlace> place, bool another);
  /// The meter may be another one, or have another interval.
  void OnReconnect();
  /// What was under way starts again with the pointer.
  void BreakOff();

  Step step() const;
  /// What Step::memory reads.
  MemoryRead::Stretch stretch() const { return read_->Next(); }
  /// False: that is none.
  bool OnInterval(unsigned minutes);
  /// False: there is nothing to read now; the next step is the pointer once more.
  bool OnPointer(View data, const Manner& manner);

  struct Taken {
    std::vector<PastRecord> records{};
    LoadPlace place{};  ///< to be kept with them
    bool more = false;  ///< there is something to read now. Of records: when they are kept
  };
  /// The bytes of stretch(). Records are told again until OnKept.
  Taken OnMemory(View bytes, const Scale& scale, const Manner& manner);
  /// Behind OnKept. False as of OnPointer.
  bool GoOn(const Manner& manner);

  /// The end of what was read last, for the status.
  std::optional<CivilZone::Utc> end() const;
  /// The pointer named an hour whose header is not written yet: what is there was taken.
  bool waits() const { return waits_; }
  /// Why nothing can be read, for the status; empty: it can.
  const std::string& trouble() const { return trouble_; }

 private:
  struct Block {
    std::size_t address = 0;
    std::size_t slices = 0;  // to be read of it
    std::size_t offset = 0;  // in what is read
  };

  bool PlanScan(const Manner& manner);
  bool PlanHours(const Manner& manner);
  std::optional<LoadRing::Hour> HourAfter(std::size_t address) const;
  bool Reaches(std::size_t from, std::size_t current) const;
  bool IsWritten(std::size_t address, const std::optional<LoadHeader>& header) const;
  void TakeScan(View bytes);
  bool TakeHours(View bytes, const Scale& scale, Taken& taken);
  void Add(PastRecord record, std::vector<PastRecord>& records) const;
  void Lose();
  CivilZone::Utc EndOf(const LoadPlace& place) const;

  unsigned profile_;
  CivilZone zone_;
  LoadRing ring_;
  bool knows_interval_ = false;
  bool waits_ = false;
  std::string trouble_;
  std::optional<LoadPointer> pointer_;
  std::optional<LoadRing::Hour> current_;  // the hour that the pointer names
  std::optional<LoadPlace> place_;
  std::optional<std::size_t> scan_;  // a header is looked for from there on
  bool scanned_ = false;             // there was none so far
  std::optional<CivilZone::Utc>
      floor_;  // what was before it is told; behind it something is missing
  std::vector<Block> blocks_;
  std::optional<MemoryRead> read_;
};

}  // namespace baudgate::protocols::set4tm
