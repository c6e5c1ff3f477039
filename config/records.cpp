// SPDX-License-Identifier: Apache-2.0
#include "config/records.h"

#include <algorithm>
#include <utility>

#include "config/history.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostRecords = 16;
constexpr std::size_t kMostRecordPatterns = 100;
constexpr std::size_t kMostValues = 200;

std::vector<std::uint32_t> PointsOf(const RecordPattern& record, const Device& device,
                                    Problems& problems) {
  std::vector<std::uint32_t> points;
  for (const std::string& pattern : record.points) {
    bool used = false;
    for (std::uint32_t i = 0; i < device.points.size(); ++i) {
      const Point& point = device.points[i];
      if (point.access == Access::write || !MatchesPattern(pattern, point.name)) continue;
      used = true;
      if (std::ranges::find(points, i) == points.end()) points.push_back(i);
    }
    if (used) continue;
    problems.Error(record.mark, "records: " + Quoted(pattern) + " of '" + record.name +
                                    "' matches no point that can be read");
  }
  if (points.size() > kMostValues) {
    problems.Error(record.mark, "records: '" + record.name + "' has " +
                                    std::to_string(points.size()) + " points; at most " +
                                    std::to_string(kMostValues));
  }
  return points;
}

/// Some event that is kept has it.
bool IsOwed(const std::string& record, const Device& device) {
  const auto has_it = [&](const auto& event) { return event.record == record; };
  if (device.events && std::ranges::any_of(device.event_texts, has_it)) return true;
  return device.point_events && std::ranges::any_of(device.points, [&](const Point& point) {
           return std::ranges::any_of(point.events, has_it);
         });
}

}  // namespace

std::vector<RecordPattern> ReadRecords(const YamlNode& node, Problems& problems) {
  std::vector<RecordPattern> records;
  for (const Entry& entry : ReadEntries(node, "records", problems)) {
    RecordPattern& record = records.emplace_back();
    record.name = entry.key;
    record.mark = entry.value.mark();
    MapReader one(entry.value, "record '" + record.name + "'", problems);
    if (const auto points = one.Need("points", "[ trip_phases ]")) {
      for (const YamlNode& element : ReadList(*points, "points", kMostRecordPatterns, problems)) {
        if (auto text = ReadText(element, "points", problems)) {
          record.points.push_back(std::move(*text));
        }
      }
    }
    one.Finish();
  }
  if (records.size() > kMostRecords) {
    problems.Error(node.mark(), "records: at most " + std::to_string(kMostRecords));
  }
  return records;
}

void CheckRecordName(const std::string& name, const Mark& mark,
                     const std::vector<RecordPattern>& records, Problems& problems) {
  if (name.empty() || std::ranges::find(records, name, &RecordPattern::name) != records.end()) {
    return;
  }
  std::vector<std::string_view> names;
  for (const RecordPattern& record : records) names.push_back(record.name);
  problems.Error(mark, "record: 'records' of the profile has no " + Quoted(name) + ";" +
                           DidYouMean(name, names) +
                           " it has: " + (names.empty() ? "none" : Join(names)));
}

void ResolveRecords(const std::vector<RecordPattern>& records, Device& device, Problems& problems) {
  for (const Point& point : device.points) {
    for (const PointEvent& event : point.events) {
      CheckRecordName(event.record, point.mark, records, problems);
    }
  }
  for (const RecordPattern& pattern : records) {
    Record& record = device.records.emplace_back();
    record.name = pattern.name;
    record.points = PointsOf(pattern, device, problems);
    if (!IsOwed(record.name, device)) continue;
    for (const std::uint32_t index : record.points) {
      Group& group = device.points[index].group;
      if (group == Group::slow) group = Group::daily;
    }
  }
}

}  // namespace baudgate::config
