// Builds the map from the configuration and divides requests into pieces.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/register_map.h"

#include <algorithm>
#include <span>

#include "gateway/outputs/modbus/registers/register_contents.h"

namespace baudgate::modbus {
namespace {

constexpr std::uint16_t kDeviceUnit = 1;  // units_[1…] are devices

bool InValueArea(const Span& span) {
  return span.count > 0 && config::IsValueArea(span.start, span.end() - 1);
}

bool StartsBelow(std::uint32_t address, const Span& span) { return address < span.start; }

/// Looks up ascending addresses in sorted spans. Most requests ask for neighbours, so the span
/// after the last one found is tried before a search.
class Finder {
 public:
  explicit Finder(const std::vector<Span>& spans) : spans_(spans) {}

  /// The span that holds `address`, or null.
  const Span* Find(std::uint32_t address) {
    if (next_ < spans_.size() && spans_[next_].start == address) return &spans_[next_++];
    const auto after = std::upper_bound(spans_.begin(), spans_.end(), address, StartsBelow);
    next_ = static_cast<std::size_t>(after - spans_.begin());
    if (next_ == 0) return nullptr;
    const Span& span = spans_[next_ - 1];
    return address < span.end() ? &span : nullptr;
  }

 private:
  const std::vector<Span>& spans_;
  std::size_t next_ = 0;
};

/// Overlaps and addresses outside the value areas are refused when the configuration is checked;
/// should one come through, the first point keeps the addresses and no other shows in its place.
void Insert(std::vector<Span>& spans, const Span& span) {
  if (!InValueArea(span)) return;
  const auto after = std::upper_bound(spans.begin(), spans.end(), span.start, StartsBelow);
  if (after != spans.end() && after->start < span.end()) return;
  if (after != spans.begin() && std::prev(after)->end() > span.start) return;
  spans.insert(after, span);
}

UnitMap MapOf(const config::Device& device, std::uint32_t index) {
  UnitMap unit;
  unit.kind = UnitMap::Kind::device;
  unit.device = index;
  unit.status_layout.assign(kDeviceBlockLayout.begin(), kDeviceBlockLayout.end());
  for (std::uint32_t i = 0; i < device.points.size(); ++i) {
    const config::Point& point = device.points[i];
    if (!point.modbus) continue;
    const bool bit = point.table == config::Table::bits;
    const std::size_t count = bit ? 1 : config::RegisterCount(point);
    if (count > kValuesEnd) continue;
    Insert(bit ? unit.bits : unit.registers, {*point.modbus, static_cast<std::uint16_t>(count), i,
                                              point.access != config::Access::write});
    if (point.writing.select && point.writing.allowed) unit.selects.emplace(*point.modbus, i);
  }
  return unit;
}

/// Walks one request from address to address.
class Planner {
 public:
  Planner(const UnitMap& unit, config::Table table, std::uint16_t start, std::uint16_t count,
          std::vector<Piece>& pieces)
      : unit_(unit),
        finder_(unit.spans(table)),
        table_(table),
        at_(start),
        start_(start),
        end_(static_cast<std::uint32_t>(start) + count),
        pieces_(pieces) {
    pieces_.clear();
  }

  ExceptionCode Read(Holes holes) {
    bool nothing = true;
    while (at_ < end_) {
      if (ReadStep()) {
        nothing = false;
      } else if (holes == Holes::zero) {
        AddHole();
      } else {
        return kIllegalAddress;
      }
    }
    return nothing ? kIllegalAddress : Verdict();
  }

  ExceptionCode Write() {
    while (at_ < end_) {
      const Span* span = finder_.Find(at_);
      if (span == nullptr) return kIllegalAddress;
      AddValue(*span);
    }
    return Verdict();
  }

 private:
  ExceptionCode Verdict() const { return cut_ ? kIllegalValue : kNoException; }

  bool ReadStep() {
    if (at_ >= kAgeOffset) {
      return table_ == config::Table::registers && AddMirror(Area::age, kAgeOffset);
    }
    if (at_ >= kQualityOffset) return AddMirror(Area::quality, kQualityOffset);
    if (at_ >= kEventBlock && at_ < kValuesAfterStatus) {
      return AddBlock(Area::events, kEventBlock, kEventBlockLayout);
    }
    if (at_ >= kStatusBlock && at_ < kEventBlock) {
      return AddBlock(Area::status, kStatusBlock, unit_.status_layout);
    }
    const Span* span = finder_.Find(at_);
    if (span == nullptr || !span->readable) return false;
    AddValue(*span);
    return true;
  }

  void AddValue(const Span& span) {
    if (span.start != at_ || span.end() > end_) cut_ = true;
    Add(Area::value, span.point, std::min(span.end(), end_));
  }

  bool AddMirror(Area area, std::uint32_t offset) {
    const Span* span = finder_.Find(at_ - offset);
    if (span == nullptr || !span->readable) return false;
    Add(area, span->point, std::min(span->end() + offset, end_));
    return true;
  }

  bool AddBlock(Area area, std::uint32_t start, std::span<const std::uint16_t> layout) {
    if (table_ != config::Table::registers || layout.empty()) return false;
    const std::uint32_t block_end = start + layout.back();
    if (at_ >= block_end) return false;
    const std::uint32_t stop = std::min(block_end, end_);
    const auto boundary = [&](std::uint32_t address) {
      return std::binary_search(layout.begin(), layout.end(), address - start);
    };
    if (!boundary(at_) || !boundary(stop)) cut_ = true;
    Add(area, at_ - start, stop);
    return true;
  }

  /// One address; neighbours make one hole.
  void AddHole() {
    if (!pieces_.empty() && pieces_.back().area == Area::hole) {
      ++pieces_.back().count;
      ++at_;
    } else {
      Add(Area::hole, 0, at_ + 1);
    }
  }

  void Add(Area area, std::uint32_t index, std::uint32_t stop) {
    pieces_.push_back({area, index, static_cast<std::uint16_t>(at_ - start_),
                       static_cast<std::uint16_t>(stop - at_)});
    at_ = stop;
  }

  const UnitMap& unit_;
  Finder finder_;
  config::Table table_;
  std::uint32_t at_;
  std::uint32_t start_;
  std::uint32_t end_;
  std::vector<Piece>& pieces_;
  bool cut_ = false;
};

}  // namespace

RegisterMap::RegisterMap(const config::Config& config) {
  UnitMap gateway;
  gateway.kind = UnitMap::Kind::gateway;
  gateway.status_layout.assign(kGatewayBlockLayout.begin(), kGatewayBlockLayout.end());
  units_ = {UnitMap{}};
  std::uint32_t index = 0;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (device.unit && unit_index_[*device.unit] < kDeviceUnit) {
        unit_index_[*device.unit] = static_cast<std::uint16_t>(units_.size());
        units_.push_back(MapOf(device, index));
      }
      ++index;
    }
  }
  unit_index_[0] = unit_index_[255] = static_cast<std::uint16_t>(units_.size());
  units_.push_back(std::move(gateway));
}

ExceptionCode PlanRead(const UnitMap& unit, config::Table table, std::uint16_t start,
                       std::uint16_t count, std::vector<Piece>& pieces, Holes holes) {
  return Planner(unit, table, start, count, pieces).Read(holes);
}

ExceptionCode PlanWrite(const UnitMap& unit, config::Table table, std::uint16_t start,
                        std::uint16_t count, std::vector<Piece>& pieces) {
  return Planner(unit, table, start, count, pieces).Write();
}

}  // namespace baudgate::modbus
