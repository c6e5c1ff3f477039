// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/record_requests.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/outputs/status/records_json.h"
#include "gateway/outputs/status/target.h"
#include "gateway/outputs/status/value_json.h"
#include "gateway/records/audit/audit_source.h"

namespace baudgate::control {
namespace {

using Json = nlohmann::ordered_json;

/// Parses LINE[.DEVICE[.POINT]]. Names of lines, devices and points contain no dot.
Result<events::AckQuery> Named(const std::string& target) {
  const auto parts = Split(target, '.');
  if (parts.empty() || parts[0].empty() || parts.size() > 3) {
    return Error{Quoted(target) +
                 " is not an alarm: write LINE, LINE.DEVICE, LINE.DEVICE.POINT or the number of an "
                 "event"};
  }
  events::AckQuery query;
  query.line = parts[0];
  if (parts.size() > 1) query.device = parts[1];
  if (parts.size() == 3) query.point = parts[2];
  return query;
}

/// Finds the alarms whose place is `target`, in the form in which the command `alarms` prints it
/// (events::PlaceOf). Example: "gateway" for alarms that belong to no line.
std::optional<events::AckQuery> Shown(const std::vector<events::Alarm>& alarms,
                                      const std::string& target) {
  const auto found = std::ranges::find(alarms, target, events::PlaceOf);
  if (found == alarms.end()) return std::nullopt;
  events::AckQuery query;
  query.line = found->line;
  query.device = found->device;
  query.point = found->point;
  return query;
}

/// Returns one page of alarms, sorted by the number of the event that raised each alarm. `after`:
/// the last number of the previous page.
status::Json AlarmsPage(const events::EventSource& events, std::int64_t after) {
  std::vector<events::Alarm> alarms = events.Alarms();
  std::ranges::sort(alarms, {}, &events::Alarm::seq);
  std::erase_if(alarms, [after](const events::Alarm& alarm) { return alarm.seq <= after; });
  status::Json page = {{"records", status::Json::array()}, {"next", after}, {"more", false}};
  for (const events::Alarm& alarm : alarms) {
    page["more"] = page["records"].size() == events::kPage;
    if (page["more"]) break;
    page["records"].push_back(status::AlarmJson(alarm));
    page["next"] = alarm.seq;
  }
  return page;
}

/// Returns the query for the alarms of `target`: a line ("bay-1", without its devices), a device
/// ("bay-1.feeder-1"), a point, the number of an event, or a text of events::PlaceOf. Returns an
/// error if neither an alarm nor the configuration has this name. A removed device can still have
/// alarms.
Result<events::AckQuery> FindAlarms(const config::Config& config, const events::EventSource& events,
                                    const std::string& target) {
  const std::vector<events::Alarm> alarms = events.Alarms();
  events::AckQuery query;
  if (const auto seq = ParseInteger<std::int64_t>(target)) {
    query.seqs = {*seq};
    if (std::ranges::find(alarms, *seq, &events::Alarm::seq) != alarms.end()) return query;
    return Error{"event " + target +
                 " has no alarm in the list; 'baudgate alarms' lists the alarms"};
  }
  if (auto shown = Shown(alarms, target)) return *shown;
  const auto named = Named(target);
  if (!named) return named;
  if (std::ranges::any_of(alarms, [&](const auto& alarm) { return named->Means(alarm); })) {
    return named;
  }
  if (named->point.empty()) {
    const auto found = status::FindTarget(config, target);
    if (!found) return Error{found.error()};
  } else if (const auto found = status::FindPoint(config, target); !found) {
    return Error{found.error()};
  }
  return named;
}

/// Returns the query for the request `ack`, which has one of three members:
///   `target`  see FindAlarms
///   `line`    all alarms of the line, its devices and points
///   `seq`     the numbers of alarms as a person has seen them. An alarm that has gone, or was
///             raised again, is not selected.
Result<events::AckQuery> AckOf(const Gateway& gateway, const Json& request) {
  events::AckQuery query;
  if (const auto seqs = request.find("seq"); seqs != request.end()) {
    for (const Json& seq : *seqs) query.seqs.push_back(seq.get<std::int64_t>());
    return query;
  }
  query.whole_line = request.contains("line");
  if (!query.whole_line) {
    return FindAlarms(*gateway.config, *gateway.info.events, TextOf(request, "target"));
  }
  query.line = TextOf(request, "line");
  const std::vector<events::Alarm> alarms = gateway.info.events->Alarms();
  const bool has_alarm = !query.line.empty() && std::ranges::any_of(alarms, [&](const auto& alarm) {
    return query.Means(alarm);
  });
  if (has_alarm) return query;
  const auto found = status::FindTarget(*gateway.config, query.line);
  if (!found) return Error{found.error()};
  if (found->device) return Error{Quoted(query.line) + " is a device; name a line"};
  return query;
}

status::Json AckJson(const events::Acknowledged& done) {
  return {{"ok", true}, {"acknowledged", done.alarms}, {"trouble", done.trouble}};
}

/// Parses LINE.DEVICE.NAME.NAME, the name of values that a meter has stored itself. Returns nothing
/// if there are not four parts; the name of a point has three.
std::optional<events::PastQuery> PastQueryOf(const std::string& text) {
  const auto parts = Split(text, '.');
  if (parts.size() != 4) return std::nullopt;
  return events::PastQuery{.line = std::string(parts[0]),
                           .device = std::string(parts[1]),
                           .name = std::string(parts[2]) + "." + std::string(parts[3])};
}

}  // namespace

using Json = nlohmann::ordered_json;

Json PageJson(const events::PastPage& page, const std::string& point) {
  Json records = Json::array();
  for (const events::PastRow& row : page.rows) {
    Json json = {{"time", FormatWallTime(row.time)}, {"point", point}};
    json["value"] = status::ValueJson(row.value);
    if (row.quality) {
      json["quality"] = row.quality->word();
      json["quality_text"] = Name(*row.quality);
      json["seconds"] = row.span / 1s;
    } else {
      json["quality"] = nullptr;
      json["gap"] = "overwritten";
      json["until"] = FormatWallTime(row.time + row.span);
    }
    records.push_back(std::move(json));
  }
  return {{"records", std::move(records)},
          {"next", Json::array({page.next.seq, page.next.time})},
          {"more", page.more}};
}

namespace {

/// `history`: values of points; `events`: values that meters have stored themselves. Null: none are
/// stored.
struct KeptValues {
  const config::Config& config;
  const history::HistorySource* history = nullptr;
  const events::EventSource* events = nullptr;
};

constexpr std::string_view kNoHistory =
    "this gateway records no history: add 'history: { points: [ \"*.*.*\" ] }' to its "
    "configuration, or list only the points that you need";

constexpr std::int64_t kMostEvery = 31 * history::kDay;

std::optional<history::Cursor> CursorOf(const Json& request) {
  const auto found = request.find("after");
  if (found == request.end() || !found->is_array() || found->size() != 2) return std::nullopt;
  if (!(*found)[0].is_number_integer() || !(*found)[1].is_number_integer()) return std::nullopt;
  return history::Cursor{(*found)[0].get<std::int64_t>(), (*found)[1].get<std::int64_t>()};
}

Status KeepsPoint(const std::string& text, const config::Config& config) {
  const auto target = status::FindPoint(config, text);
  if (!target) return Error{target.error()};
  const auto& points = config.history.points;
  const bool kept = std::ranges::any_of(points, [&](const config::HistoryPoint& point) {
    return point.device == target->device && point.point == target->point;
  });
  if (kept) return {};
  return Error{"the values of " + Quoted(text) +
               " are not recorded: add the point to history.points of the configuration"};
}

struct ReadPage {
  Json json;
  bool known = false;
};

Result<ReadPage> ReadTrends(const Json& request, const std::string& point, std::int64_t every,
                            const history::HistorySource& history) {
  history::TrendQuery query{.point = point, .every = every};
  if (const auto since = TimeOf(request, "since_ms")) query.since = history::ToMillis(*since);
  query.until = NumberOf(request, "until_ms").value_or(query.until);
  if (const auto next = CursorOf(request)) query.since = std::max(query.since, next->time);
  const auto page = history.ReadTrends(query);
  if (!page) return Error{page.error()};
  return ReadPage{status::PageJson(*page, point), page->known};
}

Result<ReadPage> ReadSamples(const Json& request, const std::string& point,
                             const KeptValues& kept) {
  const history::HistorySource& history = *kept.history;
  history::PageQuery query{.point = point};
  if (const auto since = TimeOf(request, "since_ms")) query.since = history::ToMillis(*since);
  query.until = NumberOf(request, "until_ms").value_or(query.until);
  if (const auto next = CursorOf(request)) query.after = *next;
  const auto page = history.Read(query);
  if (!page) return Error{page.error()};
  return ReadPage{status::PageJson(*page, point, status::PointNamed(kept.config, point)),
                  page->known};
}

Json PastPage(const Json& request, events::PastQuery query, const KeptValues& kept) {
  if (kept.events == nullptr) return ErrorJson(kUnavailable, kNoEvents);
  const std::string point = TextOf(request, "point");
  if (NumberOf(request, "every_ms").value_or(0) != 0) {
    return ErrorJson(
        kUsage,
        Quoted(point) + " is recorded in the fixed periods of the meter: ask without --every");
  }
  query.since = TimeOf(request, "since_ms");
  query.until = TimeOf(request, "until_ms");
  if (const auto after = CursorOf(request)) query.after = {after->run, after->time};
  // The state is read first: if the database is opened meanwhile, values must not be reported as
  // unknown.
  const events::EventsState state = kept.events->state();
  const auto page = kept.events->ReadPast(query);
  if (!page) return ErrorJson(kUnavailable, "the history cannot be read: " + page.error());
  if (!page->known && state.disk != records::Disk::opening) {
    if (const Status known = status::KnowsDevice(kept.config, query.line, query.device); !known) {
      return ErrorJson(kUnknown, known.error());
    }
    return ErrorJson(
        kUnknown,
        "no values are stored of " + Quoted(point) +
            ". At the meter set load_profile: [1] for load profiles (load_1.active_import), or "
            "billing: [month] for billing readings (month.active_import)");
  }
  Json json = PageJson(*page, point);
  json["history"] = status::EventsJson(state);
  return json;
}

/// Returns one page of a point's values, or of the values that a meter has stored itself; an error
/// is {"error":…}. A removed point still has its values. If no values were ever stored, the error
/// contains the reason.
Json HistoryPage(const Json& request, const KeptValues& kept) {
  if (auto past = PastQueryOf(TextOf(request, "point")))
    return PastPage(request, std::move(*past), kept);
  if (kept.history == nullptr) return ErrorJson(kUnavailable, kNoHistory);
  const std::string point = TextOf(request, "point");
  const std::int64_t every = NumberOf(request, "every_ms").value_or(0);
  if (every < 0 || every % history::kMinute != 0 || every > kMostEvery) {
    return ErrorJson(kUsage, "'every' must be a whole number of minutes, at most 31d");
  }
  auto page = every > 0 ? ReadTrends(request, point, every, *kept.history)
                        : ReadSamples(request, point, kept);
  if (!page) return ErrorJson(kUnavailable, "the history cannot be read: " + page.error());
  if (!page->known) {
    if (const Status its = KeepsPoint(point, kept.config); !its) {
      return ErrorJson(kUnknown, its.error());
    }
  }
  Json json = std::move(page->json);
  const history::HistoryState state = kept.history->state();
  // The page lacks values that wait for the disk, and all values on a disk that does not answer.
  if (state.disk == records::Disk::failing || state.disk == records::Disk::stalled) {
    json["unread"].push_back(state.trouble);
  }
  json["history"] = status::HistoryJson(state);
  return json;
}

/// Returns {"points":["bay-1.feeder-1.current_l1"]}: the points of the configuration that match the
/// pattern and whose values are stored. Removed points are not listed.
Json KeptPoints(const Json& request, const KeptValues& kept) {
  if (kept.history == nullptr) return ErrorJson(kUnavailable, kNoHistory);
  const std::string pattern = TextOf(request, "pattern");
  const auto points = status::PointsLike(kept.config, pattern);
  Json names = Json::array();
  for (const std::string& point : points) {
    if (KeepsPoint(point, kept.config)) names.push_back(point);
  }
  if (!names.empty()) return {{"points", std::move(names)}};
  return ErrorJson(kUnknown,
                   points.empty()
                       ? "no point matches " + Quoted(pattern) +
                             ": write LINE.DEVICE.POINT, each with * for any text"
                       : "no point that matches " + Quoted(pattern) +
                             " is recorded: add the point to history.points of the configuration");
}

bool KeepsEvents(const Gateway& gateway) {
  return gateway.info.events != nullptr && !gateway.info.events->state().in_memory;
}

KeptValues Kept(const Gateway& gateway) {
  return {*gateway.config, gateway.info.history.get(),
          KeepsEvents(gateway) ? gateway.info.events : nullptr};
}

}  // namespace

Reply ShowWrites(const Gateway& gateway, const Request& request) {
  if (gateway.info.audit == nullptr) {
    return Refused(
        kUnavailable,
        "there are no records of writes, because this gateway permits no writes: no device has "
        "'write: allow', no line has 'ask: write', and no route permits writes");
  }
  audit::PageQuery query;
  if (TextOf(request.json, "order") == "settled") query.order = audit::PageQuery::Order::settled;
  query.after = NumberOf(request.json, "after").value_or(0);
  query.since = TimeOf(request.json, "since_ms");
  // The state is read first: if the database is opened meanwhile, an empty page must not get state
  // "fine".
  const audit::AuditState state = gateway.info.audit->state();
  const auto page = gateway.info.audit->Read(query);
  if (!page) return Refused(kUnavailable, "the records of writes cannot be read: " + page.error());
  Json json = status::PageJson(*page);
  json["audit"] = status::AuditJson(state);
  return {OneLine(json)};
}

/// Answers with one page of events. The events of a removed device can still be requested.
Reply ShowEvents(const Gateway& gateway, const Request& request) {
  if (!KeepsEvents(gateway)) return Refused(kUnavailable, kNoEvents);
  events::PageQuery query;
  query.after = NumberOf(request.json, "after").value_or(0);
  query.since = TimeOf(request.json, "since_ms");
  query.until = TimeOf(request.json, "until_ms");
  query.text = TextOf(request.json, "text");
  if (request.json.contains("kind")) {
    const std::string kind = TextOf(request.json, "kind");
    const auto& words = config::kWords<config::EventState>;
    const auto found = std::ranges::find(words, kind, &config::Word<config::EventState>::word);
    if (found == words.end()) return Refused(kUsage, "'kind' must be on, off or message");
    query.state = found->meaning;
  }
  if (request.json.contains("priority")) {
    const auto& words = events::kEventPriorities;
    const auto found = std::ranges::find(words, TextOf(request.json, "priority"));
    if (found == words.end()) {
      return Refused(kUsage, "'priority' must be high, medium, low or none");
    }
    query.priority = static_cast<config::AlarmPriority>(found - words.begin());
  }
  const std::string target = TextOf(request.json, "target");
  const std::size_t dot = target.find('.');
  if (dot != std::string::npos) query.line = target.substr(0, dot);
  query.device = dot == std::string::npos ? target : target.substr(dot + 1);
  // The state is read first: if the database is opened meanwhile, an empty page must not get state
  // "fine".
  const events::EventsState state = gateway.info.events->state();
  const auto page = gateway.info.events->Read(query);
  if (!page) return Refused(kUnavailable, "the events cannot be read: " + page.error());
  if (page->records.empty() && !target.empty()) {
    if (const Status known = status::KnowsDevice(*gateway.config, query.line, query.device);
        !known) {
      return Refused(kUnknown, known.error());
    }
  }
  Json json = status::PageJson(*page);
  json["events"] = status::EventsJson(state);
  return {OneLine(json)};
}

Reply ShowAlarms(const Gateway& gateway, const Request& request) {
  if (gateway.info.events == nullptr) return Refused(kUnavailable, kNoEvents);
  // The state is read first: if the database is opened meanwhile, an empty page must not get state
  // "fine".
  const events::EventsState state = gateway.info.events->state();
  Json json = AlarmsPage(*gateway.info.events, NumberOf(request.json, "after").value_or(0));
  json["worst"] = status::WorstJson(gateway.info.events->Alarms());
  json["events"] = status::EventsJson(state);
  return {OneLine(json)};
}

Reply Acknowledge(const Gateway& gateway, const Request& request) {
  if (gateway.info.events == nullptr) return Refused(kUnavailable, kNoEvents);
  const std::size_t members = request.json.size() - 1;  // without `command`
  if (members != 1) return Refused(kUsage, "name the alarms by 'target', 'line' or 'seq'");
  const auto seqs = request.json.find("seq");
  if (seqs != request.json.end() && (seqs->empty() || seqs->size() > events::kPage)) {
    return Refused(kUsage, "'seq' must have 1 to " + std::to_string(events::kPage) + " numbers");
  }
  auto query = AckOf(gateway, request.json);
  if (!query) return Refused(kUnknown, query.error());
  query->by = request.client.name;
  gateway.info.events->Acknowledge(
      *query, [later = request.later](const events::Acknowledged& done) { later(AckJson(done)); });
  return {};
}

Reply ShowHistory(const Gateway& gateway, const Request& request) {
  return {OneLine(HistoryPage(request.json, Kept(gateway)))};
}

Reply ShowKeptPoints(const Gateway& gateway, const Request& request) {
  return {OneLine(KeptPoints(request.json, Kept(gateway)))};
}

}  // namespace baudgate::control
