// The load profile of a meter is a ring of 8-byte records: for each hour a header and 60/T slices
// (reference, chapter 11). A slice has the counts of T minutes (the interval); its time is the
// beginning of the T minutes.
//
//   14 14 08 02 00 02 34 37    header: 14 h of 2002-08-14, summer, slices of 2 min, sum 34, spare
//   00 64 00 00 80 0A 00 00    slice: P+ 100, P- 0, Q+ 10 (incomplete), Q- 0
//   35 11 08 09 99 06 58       pointer: the slice of 11:35, 2099-09-08, will be written at 0658
//
// MemoryRead reads a range of memory in pieces, and LoadReader decides which ranges are read.
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

// MemoryRead reads ranges of a meter's memory in pieces that fit into a reply. If replies do not
// name their requests (code 06, which has no id), all pieces are read twice, the second time in
// reverse order, and accepted only if both readings are equal.
//
//   {0658, 24} in pieces of 16      0658 16 · 0668 8      and again: 0668 8 · 0658 16
class MemoryRead {
 public:
  struct Stretch {
    std::size_t address = 0;
    std::size_t count = 0;
  };
  MemoryRead(const std::vector<Stretch>& stretches, std::size_t most, bool twice);

  /// Returns the next piece to read. Call it only while done() is false.
  Stretch Next() const;
  void OnPiece(View bytes);
  bool done() const { return done_; }
  /// Returns the bytes of all ranges when done() is true. Empty: the second reading differs from
  /// the first.
  const Bytes& bytes() const { return bytes_; }

 private:
  std::vector<Stretch> pieces_;
  const bool twice_;
  std::vector<Bytes> read_;
  std::size_t count_ = 0;  // number of pieces read so far, both readings together
  bool differs_ = false;
  bool done_ = false;
  Bytes bytes_;
};

inline constexpr std::size_t kLoadRecord = 8;

struct LoadHeader {
  CivilZone::Civil begin{};  ///< begin of the hour, in local time of the meter
  bool summer = false;
  unsigned minutes = 30;

  std::size_t slices() const { return 60 / minutes; }
};
/// Parses a header; `record` has kLoadRecord bytes. Returns nothing if it is not a header: a wrong
/// sum, an impossible hour, or slices that do not fill an hour. Eight zeros have a correct sum, but
/// no valid date.
std::optional<LoadHeader> ParseLoadHeader(View record);
Bytes BytesOf(const LoadHeader& header);

/// Returns the begin of the hour in UTC. The season in the header decides which of the two equal
/// hours in autumn it is.
CivilZone::Utc UtcOf(const LoadHeader& header, const CivilZone& zone);

struct LoadSlice {
  struct Count {
    std::uint16_t pulses = 0;
    bool incomplete = false;  ///< true: the meter did not measure during the whole slice
  };
  std::array<Count, 4> counts{};
};
LoadSlice ParseLoadSlice(View record);

struct LoadPointer {
  CivilZone::Civil hour{};
  unsigned minute = 0;
  bool wrapped = false;
  std::size_t address = 0;
};
std::optional<LoadPointer> ParseLoadPointer(View data);

/// Computes the addresses of hours in a ring of `bytes` bytes. An hour that does not fit before the
/// end of the ring is written at address 0 (reference, chapter 11).
struct LoadRing {
  std::size_t bytes = 65536;
  unsigned minutes = 30;

  std::size_t block() const { return kLoadRecord * (1 + 60 / minutes); }
  std::size_t hours() const { return bytes / block(); }
  std::size_t Next(std::size_t address) const {
    return address + 2 * block() > bytes ? 0 : address + block();
  }
  /// An hour that is being written: the address of its header, and the number of its finished
  /// slices.
  struct Hour {
    std::size_t address = 0;
    std::size_t finished = 0;
  };
  /// Returns the hour that is being written, if its header is written and the pointer names the
  /// position of its next slice. Empty: no slice can be at this position.
  std::optional<Hour> HourOf(const LoadPointer& pointer) const;
  /// Returns the hour that is being written, if its header is not written yet and the pointer names
  /// the position after the last record. Empty: no record can end at this position.
  std::optional<Hour> HourBehind(const LoadPointer& pointer) const;
};

std::string NameOfLoad(unsigned profile);
/// Returns a record with the mean powers of a slice in kW and kvar: N / (2 A) · 60 / T · Kn · Kt,
/// with the count N, the length T of the slice in minutes, and A, Kn and Kt of `scale`. The values
/// of an incomplete slice are uncertain.
PastRecord RecordOf(unsigned profile, const LoadHeader& header, std::size_t slice,
                    const LoadSlice& counts, const CivilZone& zone, const Scale& scale);

// LoadReader reads one load profile from the position where its stored history ends. It decides
// which bytes of the ring are read, and turns them into records. Each reading starts with the
// header of the hour that was read last. If the header is unchanged, the hours after it are the
// next ones, because the ring would have overwritten the header first. If the header has changed,
// the ring has wrapped or was cleared, and reading continues with the oldest hour in the ring.
//
//   place 0658, header 14 14 08 02 …, 2 slices read     read 24 bytes at 0658 and 24 at 0670
//                                                       two records of 15 h; place 0670, …, 2

/// A position in the ring: the hour that was read last, and how many of its slices were read. As
/// text: "0658:1414080200023437:30".
struct LoadPlace {
  std::size_t address = 0;
  Bytes header{};
  std::size_t taken = 0;

  std::string Text() const;
  static std::optional<LoadPlace> Parse(std::string_view text);
};

class LoadReader {
 public:
  /// How the memory of this meter is read: the maximum number of bytes in a reply, and whether all
  /// pieces are read twice.
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
  /// Call it with the position where the stored history ends; empty: nothing is stored. `another`:
  /// the position belongs to another meter. Its address is then not used, and only later records
  /// are reported.
  void OnKept(std::optional<LoadPlace> place, bool another);
  /// Call it if another meter may be connected, or the interval may have changed.
  void OnReconnect();
  /// Cancels the reading under way. The next reading starts with the pointer (Step::pointer).
  void BreakOff();

  Step step() const;
  MemoryRead::Stretch stretch() const { return read_->Next(); }
  /// Takes the interval, the length of a slice. Returns false if `minutes` is not a valid interval.
  bool OnInterval(unsigned minutes);
  /// Takes the pointer: time and position of the slice that is written next. Returns false if there
  /// is nothing to read now; then the pointer must be asked again.
  bool OnPointer(View data, const Manner& manner);

  struct Taken {
    std::vector<PastRecord> records{};
    LoadPlace place{};
    /// True: more can be read, at once if `records` is empty, else after they are stored (OnKept).
    bool more = false;
  };
  /// Takes the bytes of the piece stretch(). Records are returned again until OnKept confirms them.
  Taken OnMemory(View bytes, const Scale& scale, const Manner& manner);
  /// Call it after OnKept to continue with the known pointer. Returns false if there is nothing to
  /// read.
  bool GoOn(const Manner& manner);

  /// Returns the end of the last slice that was read, for the status. Empty: no slice was read.
  std::optional<CivilZone::Utc> end() const;
  /// True if everything was read except the current hour, whose header is not written yet.
  bool waits() const { return waits_; }
  /// Returns why nothing can be read, for the status. Empty: there is no trouble.
  const std::string& trouble() const { return trouble_; }

 private:
  struct Block {
    std::size_t address = 0;
    std::size_t slices = 0;
    std::size_t offset = 0;
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
  std::optional<LoadRing::Hour> current_;  // the hour that is being written
  std::optional<LoadPlace> place_;
  std::optional<std::size_t> scan_;  // address at which the search for a header continues
  bool scanned_ = false;             // true: a part of the memory was searched and has no header
  // If the stored position was lost: the end of the last reported record. Earlier records are
  // dropped.
  std::optional<CivilZone::Utc> floor_;
  std::vector<Block> blocks_;
  std::optional<MemoryRead> read_;
};

}  // namespace baudgate::protocols::set4tm
