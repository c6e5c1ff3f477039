// Reads one load profile on from where its history ends: which bytes of the ring to ask for, and
// what records they are. Nothing is asked by time alone: each reading begins with the header of the
// hour that was read last. As long as that is what it was, the hours behind it are the next ones,
// because the ring overwrites it first; if not, the ring went round (or was cleared), and reading
// goes on with the oldest hour that is there.
//
//   place 0658, header 14 14 08 02 …, 2 taken     read 24 bytes there and 24 at 0670: two records
//                                                 of 15 h; place 0670, …, 2
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/set4tm/load_profile.h"
#include "protocols/set4tm/memory_read.h"

namespace baudgate::protocols::set4tm {

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
