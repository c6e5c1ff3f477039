// SPDX-License-Identifier: Apache-2.0
#include "config/ratios.h"

#include <optional>
#include <utility>
#include <vector>

#include "gateway/base/leading_zero.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kLongestRatioUnit = 16;

struct Ratio {
  Decimal factor = 1;
  std::string unit;
};

/// "400 A", "10 kV".
std::optional<Ratio> ReadRatio(const Entry& entry, Problems& problems) {
  const auto text = ReadText(entry.value, entry.key, problems);
  if (!text) return std::nullopt;
  const std::string_view trimmed = Trim(*text);
  const auto blank = trimmed.find(' ');
  const auto factor = Decimal::Parse(trimmed.substr(0, blank));
  const std::string_view unit =
      blank == std::string_view::npos ? std::string_view() : Trim(trimmed.substr(blank));
  if (const std::string why = WhyLeadingZero(trimmed); !why.empty()) {
    problems.Error(entry.value.mark(), "ratios: " + Quoted(*text) + " " + why);
    return std::nullopt;
  }
  const bool good = factor && *factor > 0 && !unit.empty() && unit.size() <= kLongestRatioUnit;
  if (good) return Ratio{*factor, std::string(unit)};
  problems.Error(entry.value.mark(), "ratios: " + Quoted(*text) +
                                         " is not a number above 0 and a unit; write for example " +
                                         entry.key + ": 400 A");
  return std::nullopt;
}

bool IsNumber(const Point& point) {
  return point.type != Type::boolean && point.type != Type::string;
}

void Apply(const Ratio& ratio, Point& point) {
  point.scale *= ratio.factor;
  point.offset *= ratio.factor;
  point.deadband *= ratio.factor;
  for (auto* number : {&point.jump, &point.writing.min, &point.writing.max, &point.writing.step}) {
    if (*number) **number *= ratio.factor;
  }
  if (point.on_fault.kind == OnFault::Kind::value) point.on_fault.value *= ratio.factor;
  point.unit = ratio.unit;
}

}  // namespace

void ApplyRatios(MapReader& map, Device& device) {
  const auto node = map.Get("ratios");
  if (!node) return;
  std::vector<std::pair<Point*, Ratio>> found;
  for (const Entry& entry : ReadEntries(*node, "ratios", map.problems())) {
    const auto ratio = ReadRatio(entry, map.problems());
    if (!ratio) continue;
    const std::size_t before = found.size();
    for (Point& point : device.points) {
      if (point.unit == entry.key && IsNumber(point)) found.emplace_back(&point, *ratio);
    }
    if (found.size() > before) continue;
    map.problems().Error(entry.value.mark(), "ratios: no point of '" + device.name +
                                                 "' is a number of unit " + Quoted(entry.key) +
                                                 "; 'baudgate profiles " + device.profile +
                                                 "' shows units");
  }
  for (const auto& [point, ratio] : found) Apply(ratio, *point);
}

}  // namespace baudgate::config
