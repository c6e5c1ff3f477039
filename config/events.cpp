// SPDX-License-Identifier: Apache-2.0
#include "config/events.h"

#include <algorithm>

#include "config/outputs.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostTexts = 2000;
constexpr std::size_t kLongestText = 100;
constexpr std::uint32_t kLastChannel = 999;
constexpr std::uint32_t kLastCode = 999'999;
constexpr std::array<Word<EventState>, kEventStates> kStates = {
    {{"off", EventState::off}, {"on", EventState::on}, {"message", EventState::message}}};

bool IsSame(const EventText& a, const EventText& b) {
  return a.channel == b.channel && a.code == b.code;
}

}  // namespace

Events ReadEvents(const YamlNode& node, Problems& problems) {
  Events events;
  MapReader map(node, "events", problems);
  events.given = true;
  events.directory = ReadAbsolutePath(map, "directory", "/data/baudgate");
  map.Finish();
  return events;
}

void ReadDeviceEvents(MapReader& map, bool given, Device& device) {
  const bool has_table = !device.event_texts.empty();
  const auto wanted = map.Flag("events");
  device.events = wanted.value_or(given && has_table);
  if (!device.events || has_table) return;
  map.problems().Warning(
      map.MarkOf("events"),
      "events: " +
          (device.profile.empty() ? "there is no profile with a"
                                  : Quoted(device.profile) + " has no") +
          " table of events: they come without texts, and none come where the protocol has none");
}

std::vector<EventText> ReadEventTable(const YamlNode& node, Problems& problems) {
  std::vector<EventText> table;
  for (const YamlNode& element : ReadList(node, "events", kMostTexts, problems)) {
    MapReader map(element, "event", problems);
    EventText one;
    one.channel = map.Integer<std::uint32_t>("channel", 0, kLastChannel);
    if (map.Need("code", "1")) {
      Assign(one.code, map.Integer<std::uint32_t>("code", 1, kLastCode));
    }
    if (map.Need("text", "stage I> started")) Assign(one.text, map.Label("text"));
    Assign(one.state, map.OneOf("state", kStates));
    if (one.text.size() > kLongestText) {
      problems.Error(map.MarkOf("text"),
                     "text: it is too long; at most " + std::to_string(kLongestText) + " bytes");
    }
    map.Finish();
    const auto same = [&](const EventText& other) { return IsSame(one, other); };
    if (std::ranges::any_of(table, same)) {
      problems.Error(map.MarkOf("code"),
                     "code: " + std::to_string(one.code) + " stands in the table twice");
    }
    table.push_back(std::move(one));
  }
  return table;
}

}  // namespace baudgate::config
