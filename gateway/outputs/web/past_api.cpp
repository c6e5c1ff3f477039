// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/past_api.h"

#include <algorithm>
#include <array>
#include <asio/post.hpp>
#include <cmath>
#include <cstring>
#include <utility>

#include "gateway/base/guarded.h"
#include "gateway/base/text.h"
#include "gateway/outputs/status/history_csv.h"
#include "gateway/outputs/status/target.h"
#include "gateway/records/history/chart.h"

namespace baudgate::web {
namespace {

using control::Json;

constexpr std::array<std::string_view, 3> kPaths = {"/api/v1/events", "/api/v1/history",
                                                    "/api/v1/history.csv"};

Json RowsJson(const history::Chart& chart) {
  Json rows = Json::array();
  for (const history::Trend& row : chart.rows) {
    const double share = static_cast<double>(row.good) / static_cast<double>(chart.step);
    rows.push_back(
        {row.begin, row.min, row.mean, row.max, std::round(std::min(1.0, share) * 1000) / 1000});
  }
  return rows;
}

}  // namespace

/// A table that is read page by page, as fast as it is taken.
class PastApi::Download final : public Stream, public std::enable_shared_from_this<Download> {
 public:
  Download(std::weak_ptr<PastApi*> api, asio::io_context& io, Json ask)
      : api_(std::move(api)),
        io_(io),
        ask_(std::move(ask)),
        text_(control::HistoryCsvHead(false)) {}

  std::ptrdiff_t Read(std::span<char> into) override {
    const MutexLock lock(mutex_);
    if (sent_ == text_.size()) {
      if (ended_) return kEnd;
      if (!std::exchange(asked_, true)) {
        asio::post(io_, [self = shared_from_this()] { self->ReadPage(); });
      }
      return 0;
    }
    const std::size_t bytes = std::min(into.size(), text_.size() - sent_);
    std::memcpy(into.data(), text_.data() + sent_, bytes);
    sent_ += bytes;
    return static_cast<std::ptrdiff_t>(bytes);
  }
  void SetWake(std::function<void()> wake) override {
    const MutexLock lock(mutex_);
    wake_ = std::move(wake);
  }

 private:
  /// On the thread of the past. A page that fails ends it: what has come is good.
  void ReadPage() {
    const auto api = api_.lock();
    const Json page =
        api ? Json::parse((*api)->Page(ask_, ReadClocks()), nullptr, false) : Json(nullptr);
    std::string text;
    const bool good = page.is_object() && page.contains("records");
    if (good) {
      for (const Json& record : page["records"]) text += control::HistoryCsvRow(record, false);
      ask_["after"] = page["next"];
    }
    std::function<void()> wake;
    {
      const MutexLock lock(mutex_);
      text_ = std::move(text);
      sent_ = 0;
      asked_ = false;
      ended_ = !good || !page.value("more", false);
      wake = wake_;
    }
    if (wake) wake();
  }

  const std::weak_ptr<PastApi*> api_;
  asio::io_context& io_;
  Json ask_;  // of the next page; on the thread of the past
  Mutex mutex_;
  std::string text_ BAUDGATE_GUARDED_BY(mutex_);
  std::size_t sent_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  bool asked_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool ended_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::function<void()> wake_ BAUDGATE_GUARDED_BY(mutex_);
};

PastApi::PastApi(const config::Config& config, const PointStore& store, LineControl& lines,
                 control::GatewayInfo info, asio::io_context& io)
    : io_(io), handler_(config, store, lines, no_writes_, std::move(info)) {}

bool PastApi::Has(std::string_view path) { return std::ranges::find(kPaths, path) != kPaths.end(); }

bool PastApi::Answer(const Request& request, Now now, const Answered& answered) {
  if (request.path == kPaths[0]) {
    answered(Events(request, now));
  } else if (request.path == kPaths[1]) {
    answered(History(request, now));
  } else if (request.path == kPaths[2]) {
    answered(HistoryCsv(request, now));
  } else {
    return false;
  }
  return true;
}

std::string PastApi::Page(const Json& ask, Now now) {
  const std::string text = ask.dump(-1, ' ', false, Json::error_handler_t::replace);
  return handler_.Answer(text, {"web"}, now, {}).text;
}

Response PastApi::Events(const Request& request, Now now) {
  const auto ask = AskOf(request, "events", {{"after", true}, {"since_ms", true}, {"target"}});
  if (!ask) return Problem(400, ask.error());
  return ResponseOf(Page(*ask, now));
}

Response PastApi::History(const Request& request, Now now) {
  const auto ask = AskOf(request, "chart",
                         {{"point"}, {"since_ms", true}, {"until_ms", true}, {"pixels", true}});
  if (!ask) return Problem(400, ask.error());
  history::ChartQuery query;
  query.point = ask->value("point", "");
  const history::Millis now_ms = history::ToMillis(now.wall);
  query.until = std::min(ask->value("until_ms", now_ms), now_ms);
  query.since = ask->value("since_ms", query.until - history::kHour);
  query.pixels = ask->value("pixels", query.pixels);
  if (query.pixels < 1 || query.pixels > history::kMostPixels) {
    return Problem(400, "'pixels' is a number from 1 to " + std::to_string(history::kMostPixels));
  }
  constexpr history::Millis kMost = 20 * 366 * history::kDay;
  if (query.since >= query.until || query.until - query.since > kMost || query.since < 0) {
    return Problem(400, "'since_ms' is before 'until_ms', by twenty years at most");
  }
  // Why a point has nothing, the control socket says.
  const auto gateway = handler_.gateway();
  if (!gateway->info.history)
    return ResponseOf(Page({{"command", "history"}, {"point", query.point}}, now));
  const auto chart = history::ReadChart(*gateway->info.history, query);
  if (!chart) return Problem(503, "the history cannot be read: " + chart.error());
  const auto point = control::FindPoint(*gateway->config, query.point);
  if (!chart->known) {
    const std::string page = Page({{"command", "history"}, {"point", query.point}}, now);
    if (page.starts_with("{\"error\"")) return ResponseOf(page);
  }
  std::string unit;
  if (point) {
    std::uint32_t device = 0;
    for (const config::Line& line : gateway->config->lines) {
      for (const config::Device& its : line.devices) {
        if (device++ == point->device) unit = its.points[point->point].unit;
      }
    }
  }
  return JsonResponse({{"point", query.point},
                       {"unit", unit},
                       {"step_ms", chart->step},
                       {"rows", RowsJson(*chart)}});
}

Response PastApi::HistoryCsv(const Request& request, Now now) {
  const auto ask = AskOf(request, "history", {{"point"}, {"since_ms", true}, {"until_ms", true}});
  if (!ask) return Problem(400, ask.error());
  const std::string first = Page(*ask, now);
  if (first.starts_with("{\"error\"")) return ResponseOf(first);
  std::string name = request.Query("point").value_or("");
  std::erase_if(name, [](char c) { return c == '"' || c == '\\' || c < 0x21 || c > 0x7E; });
  Response response;
  response.type = "text/csv; charset=utf-8";
  response.headers.emplace_back("Content-Disposition", "attachment; filename=\"" + name + ".csv\"");
  response.stream = std::make_shared<Download>(alive_, io_, *ask);
  return response;
}

}  // namespace baudgate::web
