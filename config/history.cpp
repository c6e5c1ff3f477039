// SPDX-License-Identifier: Apache-2.0
#include "config/history.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "config/files.h"
#include "gateway/base/decimal.h"
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
                                    "' matches no point that can be read; correct the pattern");
  }
  if (points.size() > kMostValues) {
    problems.Error(record.mark, "records: '" + record.name + "' has " +
                                    std::to_string(points.size()) + " points; at most " +
                                    std::to_string(kMostValues));
  }
  return points;
}

/// True if an event that is recorded for the device needs this record.
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
    problems.Error(node.mark(), "records: the profile has too many records; at most " +
                                    std::to_string(kMostRecords));
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
  problems.Error(mark, "record: the profile has no record " + Quoted(name) + ";" +
                           DidYouMean(name, names) +
                           " records: " + (names.empty() ? "none" : Join(names)));
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

namespace {

constexpr std::size_t kMostPatterns = 1000;
constexpr std::uint64_t kLeastLimit = 50 * kMegabyte;
constexpr std::uint64_t kMostLimit = 10'000'000 * kMegabyte;

enum class Log : std::uint8_t { changes, all, off };

struct Pattern {
  std::array<std::string, 3> parts;  // patterns of line, device and point
  Log log = Log::changes;
  std::optional<Decimal> deadband;
  HistoryPoint kept;
  Mark mark;
  std::string text;
  bool used = false;
};

Result<std::uint64_t> ParseLimit(std::string_view text) {
  const Error none{Quoted(text) + " is not a size; write for example 500MB or 2.5GB"};
  if (const std::string why = WhyLeadingZero(text); !why.empty()) {
    return Error{Quoted(text) + " " + why};
  }
  const auto digits = text.find_first_not_of("0123456789.");
  if (digits == std::string_view::npos) return none;
  const auto number = ParseDecimal(text.substr(0, digits));
  const std::string_view unit = Trim(text.substr(digits));
  const double factor = unit == "MB" ? 1 : unit == "GB" ? 1000 : unit == "TB" ? 1'000'000 : 0;
  if (!number || factor == 0 || *number > 1e9) return none;
  const auto size = static_cast<std::uint64_t>(std::llround(*number * factor * double{kMegabyte}));
  if (size < kLeastLimit || size > kMostLimit)
    return Error{"the size is out of range; allowed: 50MB…10TB"};
  return size;
}

/// Splits the text into three patterns. Returns false after it has reported that the text has
/// another form.
bool Split(Pattern& pattern, Problems& problems) {
  std::string_view rest = pattern.text;
  for (std::size_t i = 0; i < pattern.parts.size(); ++i) {
    const bool last = i + 1 == pattern.parts.size();
    const std::size_t dot = rest.find('.');
    if (rest.empty() || dot == 0 || (dot == std::string_view::npos) != last) {
      problems.Error(pattern.mark, "points: " + Quoted(pattern.text) +
                                       " is not a pattern; write LINE.DEVICE.POINT, with * for any "
                                       "text and ? for any character");
      return false;
    }
    pattern.parts[i] = std::string(rest.substr(0, dot));
    if (!last) rest.remove_prefix(dot + 1);
  }
  return true;
}

std::optional<Pattern> ReadPattern(const YamlNode& node, const HistoryPoint& usual,
                                   Problems& problems) {
  Pattern pattern;
  pattern.kept = usual;
  if (node.kind() == YamlNode::Kind::map) {
    MapReader map(node, "points", problems);
    if (map.Need("match", "\"bay-1.*.current_*\"")) Assign(pattern.text, map.Text("match"));
    pattern.mark = map.MarkOf("match");
    Assign(pattern.log, map.OneOf("log", kWords<Log>));
    pattern.deadband = map.Number("deadband");
    if (pattern.deadband && pattern.deadband->is_negative()) {
      problems.Error(map.MarkOf("deadband"), "deadband: must not be negative; write 0 or more");
    }
    map.Read<&HistoryPoint::max_gap>(pattern.kept);
    map.Finish();
    if (pattern.text.empty()) return std::nullopt;
  } else {
    const auto text = ReadText(node, "points", problems);
    if (!text) return std::nullopt;
    pattern.text = *text;
    pattern.mark = node.mark();
  }
  if (!Split(pattern, problems)) return std::nullopt;
  return pattern;
}

Pattern* FirstMatch(std::vector<Pattern>& patterns, const std::string& line,
                    const std::string& device, const std::string& point) {
  Pattern* first = nullptr;
  for (Pattern& pattern : patterns) {
    if (!MatchesPattern(pattern.parts[0], line) || !MatchesPattern(pattern.parts[1], device) ||
        !MatchesPattern(pattern.parts[2], point)) {
      continue;
    }
    pattern.used = true;
    if (first == nullptr) first = &pattern;
  }
  return first;
}

void Choose(std::vector<Pattern>& patterns, const Config& config, History& history) {
  std::uint32_t number = 0;
  for (const Line& line : config.lines) {
    for (const Device& device : line.devices) {
      for (std::uint32_t i = 0; i < device.points.size(); ++i) {
        const Point& point = device.points[i];
        if (point.access == Access::write) continue;
        const Pattern* pattern = FirstMatch(patterns, line.name, device.name, point.name);
        if (pattern == nullptr || pattern->log == Log::off) continue;
        history.points.push_back({number, i, pattern->log == Log::all,
                                  pattern->deadband.value_or(point.deadband),
                                  pattern->kept.max_gap});
      }
      ++number;
    }
  }
}

}  // namespace

History ReadHistory(const YamlNode& node, const Config& config, Problems& problems) {
  History history;
  MapReader map(node, "history", problems);
  history.directory = ReadAbsolutePath(map, "directory", "/data/baudgate");
  HistoryPoint usual;
  map.Read<&HistoryPoint::max_gap>(usual);
  if (const auto limit = map.Get("limit")) {
    Assign(history.limit, ReadParsed(*limit, "limit", problems, ParseLimit));
  }
  map.Read<&History::keep>(history);
  std::vector<Pattern> patterns;
  if (const auto points = map.Need("points", "[ \"bay-1.*.current_*\" ]")) {
    for (const YamlNode& element : ReadList(*points, "points", kMostPatterns, problems)) {
      if (auto pattern = ReadPattern(element, usual, problems))
        patterns.push_back(std::move(*pattern));
    }
  }
  map.Finish();
  Choose(patterns, config, history);
  const bool whole = !problems.has_error();  // after errors, points may be missing
  for (const Pattern& pattern : patterns) {
    if (pattern.used || !whole) continue;
    problems.Error(pattern.mark,
                   "points: " + Quoted(pattern.text) +
                       " matches no point that can be read; 'baudgate map' lists the points");
  }
  return history;
}

}  // namespace baudgate::config
