// All values and qualities of one unit, encoded once, so that reading them is a copy for as long as
// nothing changes. Pure. Filled from a DeviceRecord by way of register_contents.h, so that both
// ways give the same answers; gateway/outputs/modbus/service/own_units.cpp copies from it.
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

/// Registers, or bits of a byte each, in the order of their addresses without the gaps.
template <typename Word>
class TableImage {
 public:
  TableImage(const UnitMap& unit, config::Table table);

  /// Index of `start`, when the range is nothing but whole readable values.
  std::optional<std::size_t> FindValues(std::uint32_t start, std::size_t count) const;
  /// The same for qualities, which need not be whole; `start` is the address of the values.
  std::optional<std::size_t> FindQualities(std::uint32_t start, std::size_t count) const;

  void Fill(const bus::DeviceRecord& record, Instant now);
  std::size_t size() const { return values_.size(); }

  /// kNoTarget when a value of them may not be shown.
  ExceptionCode CopyValues(std::size_t at, std::span<Word> out) const;
  void CopyQualities(std::size_t at, std::span<Word> out) const;

 private:
  /// Readable values that stand side by side.
  struct Run {
    std::uint32_t start = 0;
    std::uint32_t end = 0;
    std::size_t at = 0;
  };

  std::vector<Span> spans_;
  std::vector<Run> runs_;
  std::vector<std::uint8_t> begins_;  ///< whether a value begins here, or the table ends
  std::vector<Word> values_;
  std::vector<Word> qualities_;
  std::vector<std::uint32_t> withheld_;  ///< words before this one that may not be shown
};

class RegisterImage {
 public:
  /// What a request asks for, once it is known that the image has it.
  struct Place {
    config::Table table = config::Table::registers;
    Area area = Area::value;
    std::size_t at = 0;
    std::size_t count = 0;
  };

  explicit RegisterImage(const UnitMap& unit);

  /// Nothing when the request needs more than one area, an age, the status block or an exception
  /// 0x02 or 0x03: PlanRead sees to these.
  std::optional<Place> Find(config::Table table, std::uint32_t start, std::size_t count) const;

  /// Whether the image shows the record as it is at `now`. A stale one is made again once the reads
  /// since have asked for as many words as it has, so that a large device of which little is read
  /// costs at most twice the direct way.
  bool Refresh(const bus::DeviceRecord& record, Instant now, std::size_t asked);

  /// Copies what the last successful Refresh has seen; `out` has place.count words.
  ExceptionCode Copy(const Place& place, std::span<std::uint16_t> out) const;
  ExceptionCode Copy(const Place& place, std::span<std::uint8_t> out) const;

 private:
  TableImage<std::uint16_t> registers_;
  TableImage<std::uint8_t> bits_;
  std::optional<std::uint64_t> version_;
  Instant valid_from_;
  Instant valid_until_;
  std::size_t asked_ = 0;  ///< words, since it went stale
};

}  // namespace baudgate::modbus
