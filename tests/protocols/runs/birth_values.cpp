// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/birth_values.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace baudgate::protocols {
namespace {

// The text of a reply can change a value by this part of a step.
constexpr double kHalfTolerance = 0.25;

bool IsFloat(const config::Point& point) {
  return point.type == config::Type::float32 || point.type == config::Type::float64;
}

}  // namespace

BirthCode::BirthCode(std::string_view protocol, std::vector<const config::Device*> twins)
    : protocol_(protocol), twins_(std::move(twins)) {
  for (std::size_t twin = 0; twin < twins_.size(); ++twin) {
    first_slot_.push_back(slots_.size());
    for (std::size_t i = 0; i < twins_[twin]->points.size(); ++i) slots_.push_back({twin, i});
  }
}

bool BirthCode::CanTell(std::string_view protocol, const config::Point& point) {
  if (!IsFloat(point) || point.read.empty()) return false;
  if (protocol == "dcon") return point.read.front() == '#' || point.read == "$3";
  if (protocol != "set4tm") return true;
  return point.read.find(" float_le@") != std::string::npos ||
         point.read.find(" energy@") != std::string::npos;
}

/// Returns a scale that the point's format can represent: seven characters in DCON, 0.1 Wh of a
/// meter, 2^24 of a float32, seven digits of a relay.
BirthCode::Scale BirthCode::ScaleOf(const config::Point& point) const {
  if (point.type == config::Type::uint16) return {1, 1, 60'000};
  if (protocol_ == "dcon") return {1000, 0.1, 89'000};
  if (protocol_ == "spabus") return {1, 0.01, 8'000'000};
  if (point.type == config::Type::float64) return {1, 0.01, 16'000'000};
  return {1, 1, 16'000'000};
}

Value BirthCode::At(std::size_t twin, std::size_t point, std::uint64_t reading) const {
  const config::Point& of = twins_[twin]->points[point];
  const Scale scale = ScaleOf(of);
  const std::uint64_t readings = scale.numbers / slots_.size();
  const std::uint64_t number = (first_slot_[twin] + point) * readings + reading % readings;
  const double value = scale.first + scale.step * static_cast<double>(number);
  if (IsFloat(of)) return value;
  return static_cast<std::int64_t>(value);
}

std::optional<BirthCode::Origin> BirthCode::Read(const config::Point& shown, double value) const {
  const Scale scale = ScaleOf(shown);
  const double steps = (value - scale.first) / scale.step;
  const double whole = std::round(steps);
  if (!(whole >= 0) || std::abs(steps - whole) > kHalfTolerance) return std::nullopt;
  const auto number = static_cast<std::uint64_t>(whole);
  const std::uint64_t readings = scale.numbers / slots_.size();
  if (number / readings >= slots_.size()) return std::nullopt;
  const Slot slot = slots_[number / readings];
  return Origin{slot.twin, slot.point, number % readings, readings};
}

Value BirthValues::Get(std::size_t point, Instant now) const {
  const auto written = written_.find(point);
  return written == written_.end() ? Next(point, now) : written->second.back().value;
}

Value BirthValues::Next(std::size_t point, Instant now) const {
  std::vector<Instant>& readings = readings_[point];
  if (readings.empty() || readings.back() != now) readings.push_back(now);
  return code_.At(twin_, point, readings.size() - 1);
}

void BirthValues::Set(std::size_t point, const Value& value) {
  written_[point].push_back({value, clock_()});
  ++writes_;
}

std::optional<Birth> BirthValues::Find(std::size_t point, const config::Point& shown, double value,
                                       Instant latest) const {
  const auto found = written_.find(point);
  Instant until = Instant::max();
  if (found != written_.end()) {
    const std::vector<Written>& writes = found->second;
    for (auto one = writes.rbegin(); one != writes.rend(); ++one) {
      const bool same = std::abs(ToDouble(one->value) - value) < code_.HalfStep(shown);
      if (same && one->since <= latest) return Birth{twin_, point, one->since, until};
      until = one->since;
    }
  }
  const auto origin = code_.Read(shown, value);
  const auto readings = readings_.find(point);
  const bool own = origin && origin->twin == twin_ && origin->point == point;
  if (!own || readings == readings_.end()) return std::nullopt;
  std::optional<Birth> birth;
  const std::vector<Instant>& all = readings->second;
  for (std::uint64_t i = origin->reading; i < all.size() && all[i] <= latest; i += origin->readings)
    birth = Birth{twin_, point, all[i], all[i]};
  return birth;
}

}  // namespace baudgate::protocols
