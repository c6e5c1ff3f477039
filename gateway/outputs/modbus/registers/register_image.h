// `RegisterImage` contains all values and qualities of one unit in encoded form, so that a read is
// a copy while nothing changes. No I/O, no clock. It is filled from a DeviceRecord by
// register_contents.h, so a read from the image and a direct read return the same.
// gateway/outputs/modbus/service/own_units.cpp copies from it.
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

/// `TableImage` contains registers, or bits in one byte each. They are sorted by address; unmapped
/// addresses are left out.
template <typename Word>
class TableImage {
 public:
  TableImage(const UnitMap& unit, config::Table table);

  /// Returns the index of `start` if the range consists of whole readable values.
  std::optional<std::size_t> FindValues(std::uint32_t start, std::size_t count) const;
  /// Returns the index of the qualities of the values at `start`. The range can begin or end inside
  /// a value.
  std::optional<std::size_t> FindQualities(std::uint32_t start, std::size_t count) const;

  void Fill(const bus::DeviceRecord& record, Instant now);
  std::size_t size() const { return values_.size(); }

  /// Returns kNoTarget if one of the values must not be shown.
  ExceptionCode CopyValues(std::size_t at, std::span<Word> out) const;
  void CopyQualities(std::size_t at, std::span<Word> out) const;

 private:
  /// A range of readable values without gaps in the addresses.
  struct Run {
    std::uint32_t start = 0;
    std::uint32_t end = 0;
    std::size_t at = 0;
  };

  std::vector<Span> spans_;
  std::vector<Run> runs_;
  std::vector<std::uint8_t> begins_;  ///< 1 where a value begins, and behind the last value
  std::vector<Word> values_;
  std::vector<Word> qualities_;
  /// Entry i: the number of words before index i that must not be shown.
  std::vector<std::uint32_t> withheld_;
};

class RegisterImage {
 public:
  /// The place in the image of the words that a request asks for.
  struct Place {
    config::Table table = config::Table::registers;
    Area area = Area::value;
    std::size_t at = 0;
    std::size_t count = 0;
  };

  explicit RegisterImage(const UnitMap& unit);

  /// Returns nothing if the request needs more than one area, an age, a block, or the exception
  /// 0x02 or 0x03. PlanRead handles such requests.
  std::optional<Place> Find(config::Table table, std::uint32_t start, std::size_t count) const;

  /// True if the image shows the record as it is at `now`. An outdated image is encoded again only
  /// when the reads since then have requested as many words as it contains. So a large device that
  /// is read little costs at most twice as much as with direct reads.
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
  std::size_t asked_ = 0;  ///< words that were requested since the image is outdated
};

}  // namespace baudgate::modbus
