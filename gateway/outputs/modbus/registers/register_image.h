// `RegisterImage` contains all values and qualities of one unit, encoded once, so that a read is a
// copy for as long as nothing changes. Pure. It is filled from a DeviceRecord through
// register_contents.h, so a read from the image and a direct read give the same answers.
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

/// `TableImage` contains registers, or bits in one byte each, in the order of their addresses
/// without the gaps.
template <typename Word>
class TableImage {
 public:
  TableImage(const UnitMap& unit, config::Table table);

  /// Returns the index of `start`, if the range consists of whole readable values.
  std::optional<std::size_t> FindValues(std::uint32_t start, std::size_t count) const;
  /// Returns the index of qualities, whose range may begin or end inside a value; `start` is the
  /// address of the values.
  std::optional<std::size_t> FindQualities(std::uint32_t start, std::size_t count) const;

  void Fill(const bus::DeviceRecord& record, Instant now);
  std::size_t size() const { return values_.size(); }

  /// Returns kNoTarget when one of the values may not be shown.
  ExceptionCode CopyValues(std::size_t at, std::span<Word> out) const;
  void CopyQualities(std::size_t at, std::span<Word> out) const;

 private:
  /// Readable values at adjacent addresses.
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
  /// By index: the number of words before it that may not be shown.
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

  /// Returns nothing when the request needs more than one area, an age, a block, or the exception
  /// 0x02 or 0x03: PlanRead handles these.
  std::optional<Place> Find(config::Table table, std::uint32_t start, std::size_t count) const;

  /// True if the image shows the record as it is at `now`. An outdated image is encoded again once
  /// the reads since then have asked for as many words as it contains. So a large device of which
  /// little is read costs at most twice as much as direct reads.
  bool Refresh(const bus::DeviceRecord& record, Instant now, std::size_t asked);

  /// Copies from the image as of the last successful Refresh; `out` must have room for place.count
  /// words.
  ExceptionCode Copy(const Place& place, std::span<std::uint16_t> out) const;
  ExceptionCode Copy(const Place& place, std::span<std::uint8_t> out) const;

 private:
  TableImage<std::uint16_t> registers_;
  TableImage<std::uint8_t> bits_;
  std::optional<std::uint64_t> version_;
  Instant valid_from_;
  Instant valid_until_;
  std::size_t asked_ = 0;  ///< words that were asked for since the image was outdated
};

}  // namespace baudgate::modbus
