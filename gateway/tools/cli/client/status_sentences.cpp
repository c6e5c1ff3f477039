// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/status_sentences.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/tools/cli/client/json_fields.h"
#include "gateway/tools/cli/client/status_tables.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

/// Null: there is none, or the gateway is older than this field.
const Json& PartOf(const Json& status, const char* name) {
  static const Json none;
  const auto found = status.find(name);
  return found == status.end() ? none : *found;
}
const Json& DdsOf(const Json& status) { return PartOf(status, "dds"); }

/// What fails stands above what only suffers from it: first devices that do not answer, then those
/// with the most failures among their latest exchanges.
std::pair<bool, std::uint64_t> FailsOf(const Json* device) {
  const Json& recent = PartOf(*device, "recent");
  const bool known = recent.is_object();
  return {ToneOfDevice(*device) == Tone::alarm,
          known ? Number(recent, "exchanges") - Number(recent, "ok") : 0};
}

}  // namespace

std::string HeadSentence(const Json& status) {
  const Json& lines = status.at("lines");
  std::size_t devices = 0;
  std::size_t alive = 0;
  for (const Json& line : lines) {
    devices += line.at("devices").size();
    alive += Alive(line);
  }
  return fmt::format("{}: baudgate {}, up {}, lines: {}, devices: {}, online: {}",
                     Text(status, "gateway"), Text(status, "version"),
                     MillisecondsText(status.at("uptime_ms")), lines.size(), devices, alive);
}

/// "3 subscribers"; where not all topics have as many readers: "3 subscribers of points, 3 of
/// devices, none of events, none of alarms".
std::string Subscribers(const Json& dds) {
  const std::uint64_t points = Number(dds, "subscribers");
  std::string text = Plural(points, "subscriber");
  std::string others;
  bool equal = true;
  for (const auto& [topic, readers] : PartOf(dds, "readers").items()) {
    if (topic == "points") continue;
    const std::uint64_t count = readers;
    equal = equal && count == points;
    others += fmt::format(", {} of {}", count == 0 ? "none" : std::to_string(count), topic);
  }
  return equal ? text : text + " of points" + others;
}

std::string DdsSentence(const Json& status) {
  const Json& dds = DdsOf(status);
  if (dds.is_null() || !dds.at("advice").empty()) return {};
  const std::uint64_t refused = Number(dds, "refused");
  return fmt::format("DDS domain {}: {}, {}{}{}", Number(dds, "domain"), Subscribers(dds),
                     Plural(Number(dds, "samples"), "sample"),
                     refused == 0 ? "" : fmt::format(", {} not taken by the library", refused),
                     Text(dds, "state") == "starting" ? ", the process is starting" : "");
}

std::vector<std::string> DdsTraffic(const Json& status) {
  const Json& dds = DdsOf(status);
  if (dds.is_null()) return {};
  std::vector<std::string> sentences;
  for (const char* part : {"events", "requests", "datagrams"}) {
    const auto found = dds.find(part);  // an older gateway has none
    if (found == dds.end() || found->is_null() || Text(*found, "text").empty()) continue;
    sentences.push_back("DDS " + Harmless(Text(*found, "text")));
  }
  return sentences;
}

std::string AlarmsSentence(const Json& status) {
  const Json& alarms = PartOf(PartOf(status, "events"), "alarms");
  if (!alarms.is_object()) return {};
  const std::uint64_t active = Number(alarms, "active");
  const std::uint64_t unseen = Number(alarms, "unacknowledged");
  if (active + unseen == 0) return {};
  return fmt::format("{} active, {} not acknowledged: see 'baudgate alarms'",
                     Plural(active, "alarm"), unseen);
}

std::vector<std::string> AdviceOf(const Json& status) {
  const Json& lines = status.at("lines");
  std::vector<std::string> sentences;
  const auto add = [&sentences](const std::string& who, const Json& of) {
    for (const Json& sentence : of.at("advice")) {
      sentences.push_back(Harmless(who + ": " + sentence.get<std::string>()));
    }
  };
  for (const Json& line : lines) {
    add(Text(line, "name"), line);
    std::vector<const Json*> devices;
    for (const Json& device : line.at("devices")) devices.push_back(&device);
    std::ranges::stable_sort(devices, std::ranges::greater{}, FailsOf);
    for (const Json* device : devices) {
      add(Text(line, "name") + "." + Text(*device, "name"), *device);
    }
  }
  const Json& modbus = status.at("modbus");
  for (const Json& master : modbus.at("masters")) add("master on " + Text(master, "port"), master);
  for (const Json& listener : PartOf(modbus, "closed")) {
    add("listener " + Text(listener, "listener"), listener);
  }
  for (const Json& listener : PartOf(modbus, "other_framing")) {
    add("listener " + Text(listener, "listener"), listener);
  }
  for (const Json& route : modbus.at("routes")) {
    add("route " + Text(route, "units") + " to " + Text(route, "target"), route);
  }
  if (const Json& dds = DdsOf(status); !dds.is_null()) add("DDS", dds);
  if (const Json& audit = PartOf(status, "audit"); !audit.is_null()) add("audit", audit);
  if (const Json& events = PartOf(status, "events"); !events.is_null()) add("events", events);
  if (const Json& history = PartOf(status, "history"); !history.is_null()) add("history", history);
  if (const Json& configuration = PartOf(status, "configuration"); !configuration.is_null()) {
    add("configuration", configuration);
  }
  if (const Json& files = PartOf(status, "files"); !files.is_null()) add("files", files);
  return sentences;
}

}  // namespace baudgate
