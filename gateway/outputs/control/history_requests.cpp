// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/history_requests.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/spelling.h"
#include "gateway/outputs/control/past_requests.h"
#include "gateway/outputs/control/request_text.h"
#include "gateway/outputs/status/events_json.h"
#include "gateway/outputs/status/history_json.h"
#include "gateway/outputs/status/target.h"

namespace baudgate::control {
namespace {

constexpr std::string_view kNoHistory =
    "this gateway keeps no values: write 'history: { points: [ \"*.*.*\" ] }' into its "
    "configuration, or the points that are wanted";

constexpr std::int64_t kMostEvery = 31 * history::kDay;

/// Empty: the first page.
std::optional<history::Cursor> CursorOf(const Json& request) {
  const auto found = request.find("after");
  if (found == request.end() || !found->is_array() || found->size() != 2) return std::nullopt;
  if (!(*found)[0].is_number_integer() || !(*found)[1].is_number_integer()) return std::nullopt;
  return history::Cursor{(*found)[0].get<std::int64_t>(), (*found)[1].get<std::int64_t>()};
}

Status KeepsPoint(const std::string& text, const config::Config& config) {
  const auto target = FindPoint(config, text);
  if (!target) return Error{target.error()};
  const auto& points = config.history.points;
  const bool kept = std::ranges::any_of(points, [&](const config::HistoryPoint& point) {
    return point.device == target->device && point.point == target->point;
  });
  if (kept) return {};
  return Error{"the values of " + config::Quoted(text) +
               " are not kept: it is not among history.points of the configuration"};
}

struct ReadPage {
  Json json;
  bool known = false;  ///< the point has values in the history
};

Result<ReadPage> ReadTrends(const Json& request, const std::string& point, std::int64_t every,
                            const history::HistorySource& history) {
  history::TrendQuery query{.point = point, .every = every};
  if (const auto since = TimeOf(request, "since_ms")) query.since = history::ToMillis(*since);
  query.until = NumberOf(request, "until_ms").value_or(query.until);
  if (const auto next = CursorOf(request)) query.since = std::max(query.since, next->time);
  const auto page = history.ReadTrends(query);
  if (!page) return Error{page.error()};
  return ReadPage{PageJson(*page, point), page->known};
}

Result<ReadPage> ReadSamples(const Json& request, const std::string& point,
                             const history::HistorySource& history) {
  history::PageQuery query{.point = point};
  if (const auto since = TimeOf(request, "since_ms")) query.since = history::ToMillis(*since);
  query.until = NumberOf(request, "until_ms").value_or(query.until);
  if (const auto next = CursorOf(request)) query.after = *next;
  const auto page = history.Read(query);
  if (!page) return Error{page.error()};
  return ReadPage{PageJson(*page, point), page->known};
}

/// A page of what a meter has kept itself.
Json PastPage(const Json& request, events::PastQuery query, const KeptValues& kept) {
  if (kept.events == nullptr) return ErrorJson(kUnavailable, kNoEvents);
  const std::string point = TextOf(request, "point");
  if (NumberOf(request, "every_ms").value_or(0) != 0) {
    return ErrorJson(kUsage, config::Quoted(point) +
                                 " is kept in the spans of the meter, so --every does not apply");
  }
  query.since = TimeOf(request, "since_ms");
  query.until = TimeOf(request, "until_ms");
  if (const auto after = CursorOf(request)) query.after = {after->run, after->time};
  const events::EventsState state = kept.events->state();  // before the page, as above
  const auto page = kept.events->ReadPast(query);
  if (!page) return ErrorJson(kUnavailable, "the history cannot be read: " + page.error());
  if (!page->known && state.disk != Disk::opening) {
    if (const Status known = KnowsDevice(kept.config, query.line, query.device); !known) {
      return ErrorJson(kUnknown, known.error());
    }
    return ErrorJson(
        kUnknown,
        "nothing is kept of " + config::Quoted(point) +
            ": a meter with load_profile: [1] keeps load profiles (load_1.active_import), and one "
            "with billing: [month] keeps billing readings (month.active_import)");
  }
  Json json = PageJson(*page, point);
  json["history"] = EventsJson(state);
  return json;
}

}  // namespace

Json HistoryPage(const Json& request, const KeptValues& kept) {
  if (auto past = PastQueryOf(TextOf(request, "point")))
    return PastPage(request, std::move(*past), kept);
  if (kept.history == nullptr) return ErrorJson(kUnavailable, kNoHistory);
  const std::string point = TextOf(request, "point");
  const std::int64_t every = NumberOf(request, "every_ms").value_or(0);
  if (every < 0 || every % history::kMinute != 0 || every > kMostEvery) {
    return ErrorJson(kUsage, "'every' is a whole number of minutes, 31d at most");
  }
  auto page = every > 0 ? ReadTrends(request, point, every, *kept.history)
                        : ReadSamples(request, point, *kept.history);
  if (!page) return ErrorJson(kUnavailable, "the history cannot be read: " + page.error());
  if (!page->known) {
    if (const Status its = KeepsPoint(point, kept.config); !its) {
      return ErrorJson(kUnknown, its.error());
    }
  }
  Json json = std::move(page->json);
  const history::HistoryState state = kept.history->state();
  // What waits for the disk, or lies on it and cannot be reached.
  if (state.disk == Disk::failing || state.disk == Disk::stalled) {
    json["unread"].push_back(state.trouble);
  }
  json["history"] = HistoryJson(state);
  return json;
}

Json KeptPoints(const Json& request, const KeptValues& kept) {
  if (kept.history == nullptr) return ErrorJson(kUnavailable, kNoHistory);
  const std::string pattern = TextOf(request, "pattern");
  const auto points = PointsLike(kept.config, pattern);
  Json names = Json::array();
  for (const std::string& point : points) {
    if (KeepsPoint(point, kept.config)) names.push_back(point);
  }
  if (!names.empty()) return {{"points", std::move(names)}};
  return ErrorJson(kUnknown, points.empty()
                                 ? "no point is like " + config::Quoted(pattern) +
                                       ": write LINE.DEVICE.POINT, each with * for any text"
                                 : "no value of a point like " + config::Quoted(pattern) +
                                       " is kept: history.points of the configuration has none");
}

}  // namespace baudgate::control
