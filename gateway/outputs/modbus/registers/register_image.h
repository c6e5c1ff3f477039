// `RegisterImage` is a cache of one unit: all values and qualities, already encoded, so that a read
// is a copy as long as nothing has changed. The functions of
// gateway/outputs/modbus/registers/register_contents.h fill it from a DeviceRecord, so a read
// without the image returns the same. gateway/outputs/modbus/service/own_units.cpp copies from it.
// No I/O, no clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

/// `TableImage` contains all mapped registers of a unit, or all mapped bits (one byte each), sorted
/// by address. Write-only points are left out.
template <typename Word>
class TableImage {
 public:
  TableImage(const UnitMap& unit, config::Table table);

  /// Returns the index in the table of the value at address `start`. Nothing: the range contains an
  /// unreadable address, or only a part of a value.
  std::optional<std::size_t> FindValues(std::uint32_t start, std::size_t count) const;
  /// Returns the index in the table of the quality of address `start`. The range can begin or end
  /// inside a value, because each register of a value has the value's quality.
  std::optional<std::size_t> FindQualities(std::uint32_t start, std::size_t count) const;

  void Fill(const bus::DeviceRecord& record, Instant now);
  std::size_t size() const { return values_.size(); }

  /// Returns kNoTarget if one of the values must not be shown because of its quality.
  ExceptionCode CopyValues(std::size_t at, std::span<Word> out) const;
  void CopyQualities(std::size_t at, std::span<Word> out) const;

 private:
  /// A range of readable addresses without a gap. `at`: its index in values_.
  struct Run {
    std::uint32_t start = 0;
    std::uint32_t end = 0;
    std::size_t at = 0;
  };

  std::vector<Span> spans_;
  std::vector<Run> runs_;
  std::vector<std::uint8_t> begins_;  ///< 1 where a value begins, and in the extra entry at the end
  std::vector<Word> values_;
  std::vector<Word> qualities_;
  /// Entry i: the number of words before index i that must not be shown. So a comparison of two
  /// entries checks a range.
  std::vector<std::uint32_t> withheld_;
};

class RegisterImage {
 public:
  /// The words of a request: `count` words from index `at`, in the values or the qualities.
  struct Place {
    config::Table table = config::Table::registers;
    Area area = Area::value;
    std::size_t at = 0;
    std::size_t count = 0;
  };

  explicit RegisterImage(const UnitMap& unit);

  /// Returns nothing if the image cannot answer the request: it needs more than one area, an age, a
  /// block, a single bit, or exception 0x02 or 0x03. PlanRead handles such a request.
  std::optional<Place> Find(config::Table table, std::uint32_t start, std::size_t count) const;

  /// Returns true if the image shows the record as it is at `now`. An outdated image is encoded
  /// again only after reads have requested as many words (`asked`) as it contains. So a large
  /// device that is seldom read costs at most twice as much as without an image.
  bool Refresh(const bus::DeviceRecord& record, Instant now, std::size_t asked);

  /// Copies from the image of the last successful Refresh. `out` must have place.count words.
  ExceptionCode Copy(const Place& place, std::span<std::uint16_t> out) const;
  ExceptionCode Copy(const Place& place, std::span<std::uint8_t> out) const;

 private:
  TableImage<std::uint16_t> registers_;
  TableImage<std::uint8_t> bits_;
  std::optional<std::uint64_t> version_;
  Instant valid_from_;
  Instant valid_until_;
  std::size_t asked_ = 0;  ///< words requested since the image became outdated
};

}  // namespace baudgate::modbus
