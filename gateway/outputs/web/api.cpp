// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/api.h"

#include <algorithm>
#include <array>
#include <asio/post.hpp>
#include <cmath>
#include <cstring>
#include <utility>

#include "gateway/base/fair_places.h"
#include "gateway/base/guarded.h"
#include "gateway/base/text.h"
#include "gateway/outputs/status/records_json.h"
#include "gateway/outputs/status/target.h"
#include "gateway/outputs/status/value_json.h"
#include "gateway/outputs/web/metrics.h"
#include "gateway/outputs/web/points_json.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::web {
namespace {

using status::Json;

constexpr std::string_view kError = "{\"error\":\"";
/// The beginning of the answer to an operation that was not carried out, and its `exit` if the
/// state of the gateway forbids the operation.
constexpr std::string_view kNotDone = "{\"ok\":false";
constexpr int kNotPossible = 2;

int StatusOf(const std::string& kind) {
  if (kind == "usage") return 400;
  if (kind == "unknown") return 404;
  if (kind == "denied") return 403;
  return 503;
}

Response JsonResponse(const Json& json) {
  return TextResponse(200, kJson, json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

/// Converts an answer of the control socket to an HTTP answer. An error gets its HTTP status.
Response ResponseOf(std::string answer) {
  if (answer.starts_with(kNotDone)) {
    const Json json = Json::parse(answer, nullptr, false);
    const bool conflict = json.value("exit", 0) == kNotPossible;
    return TextResponse(conflict ? 409 : 503, kJson, std::move(answer));
  }
  if (!answer.starts_with(kError)) return TextResponse(200, kJson, std::move(answer));
  const Json json = Json::parse(answer, nullptr, false);
  return Problem(StatusOf(json.value("error", "")), json.value("message", ""));
}

}  // namespace

Result<Json> AskOf(const Request& request, std::string_view command,
                   std::initializer_list<Part> parts) {
  Json ask = {{"command", command}};
  std::vector<std::string_view> names;
  for (const Part& part : parts) names.emplace_back(part.query);
  for (const auto& [name, value] : request.query) {
    const auto part = std::ranges::find(parts, name, &Part::query);
    if (part == parts.end()) {
      return Error{
          Quoted(name) + " is not a parameter of " + request.path + ";" + DidYouMean(name, names) +
          (names.empty() ? " this path has no parameters" : " parameters: " + Join(names))};
    }
    const char* const member = part->member != nullptr ? part->member : part->query;
    if (!part->number) {
      ask[member] = value;
      continue;
    }
    const auto number = ParseInteger<std::int64_t>(value);
    if (!number) return Error{Quoted(name) + " must be a whole number"};
    ask[member] = *number;
  }
  return ask;
}

namespace {

using status::Json;

bus::Writer WriterOf(const Request& request) {
  bus::Writer writer{request.Origin(), 0, {}, HostNumberOf(request.client()), request.role};
  writer.user = request.user.empty() ? "token" : request.user;
  writer.from = request.client();
  return writer;
}

Response StreamResponse(std::shared_ptr<Stream> stream) {
  Response response;
  response.type = "text/event-stream";
  response.stream = std::move(stream);
  // Without this header, nginx would withhold the first 4 KB of a stream.
  response.headers.emplace_back("X-Accel-Buffering", "no");
  return response;
}

}  // namespace

LiveApi::LiveApi(const config::Config& config, Links links, asio::io_context& io)
    : config_(std::shared_ptr<void>(), &config),
      links_(std::move(links)),
      io_(io),
      handler_(config, links_.store, links_.lines,
               links_.commands != nullptr ? *links_.commands : no_writes_, links_.info),
      points_(links_.store, links_.info.events) {
  if (links_.reload != nullptr) handler_.SetReload(*links_.reload);
}

const std::vector<LiveApi::Route>& LiveApi::Routes() {
  static const std::vector<Route> kRoutes = {
      {"/api/v1/status", &LiveApi::Status},
      {"/api/v1/points", &LiveApi::Points},
      {"/api/v1/points/stream", &LiveApi::PointsStream},
      {"/api/v1/alarms", &LiveApi::Alarms},
      {"/api/v1/map", &LiveApi::Map},
      {"/api/v1/recorded", &LiveApi::Recorded},
      {"/api/v1/trace", &LiveApi::TraceStream},
      {"/api/v1/configuration", &LiveApi::Configuration},
      {"/metrics", &LiveApi::Metrics},
  };
  return kRoutes;
}

bool LiveApi::Answer(const Request& request, Now now, const Answered& answered) {
  for (const Route& route : Routes()) {
    if (route.path != request.path) continue;
    answered((this->*route.handler)(request, now));
    return true;
  }
  return false;
}

Response LiveApi::Asked(const Request& request, std::string_view command,
                        std::initializer_list<Part> parts, Now now) {
  const auto ask = AskOf(request, command, parts);
  if (!ask) return Problem(400, ask.error());
  const std::string text = ask->dump(-1, ' ', false, Json::error_handler_t::replace);
  return ResponseOf(handler_.Answer(text, {request.Origin()}, now, {}).text);
}

Response LiveApi::Status(const Request& request, Now now) {
  return Asked(request, "status", {{"target"}}, now);
}

Response LiveApi::Alarms(const Request& request, Now now) {
  return Asked(request, "alarms", {{"after", true}}, now);
}

Response LiveApi::Recorded(const Request& request, Now now) {
  Response raw = Asked(request, "recorded", {{"line", false, "target"}, {"device"}}, now);
  const auto line = status::FindTarget(*config_, request.Query("line").value_or(""));
  if (raw.status != 200 || !line) return raw;
  Json answer = Json::parse(raw.body, nullptr, false);
  diagnosis::FrameLines frames(DecodersFor(*line, request.Query("device").value_or("")));
  Json lines = Json::array();
  const auto add = [&lines](const std::vector<std::string>& whole) {
    for (const std::string& frame : whole) lines.push_back(frame);
  };
  for (const Json& record : answer["records"]) add(frames.Take(record.get<std::string>()));
  add(frames.Flush());
  answer["records"] = std::move(lines);
  return JsonResponse(answer);
}

diagnosis::Decoders LiveApi::DecodersFor(const status::Target& target,
                                         const std::string& device) const {
  if (!links_.protocol) return {};
  return diagnosis::DecodersOf(config_->lines[target.line], links_.protocol, device);
}

Result<std::uint32_t> LiveApi::DeviceNamed(const std::string& name) const {
  if (name.empty()) return Error{"name one device: ?device=LINE.DEVICE"};
  const auto target = status::FindTarget(*config_, name);
  if (!target) return Error{target.error()};
  if (!target->device) return Error{"name one device: " + name + ".DEVICE"};
  return *target->device;
}

Response LiveApi::Points(const Request& request, Now now) {
  const auto known = AskOf(request, "points", {{"q"}, {"line"}, {"device"}});
  if (!known) return Problem(400, known.error());
  PointFilter filter;
  filter.line = request.Query("line").value_or("");
  filter.text = request.Query("q").value_or("");
  if (!filter.line.empty()) {
    const auto line = status::FindTarget(*config_, filter.line);
    if (!line) return Problem(404, line.error());
  }
  if (const auto name = request.Query("device")) {
    const auto device = DeviceNamed(*name);
    if (!device) return Problem(404, device.error());
    filter.device = *device;
  }
  return JsonResponse(PointsJson(links_.store, filter, config_->history, now));
}

Response LiveApi::PointsStream(const Request& request, Now now) {
  std::optional<std::uint32_t> only;
  if (const auto name = request.Query("device")) {
    const auto device = DeviceNamed(*name);
    if (!device) return Problem(404, device.error());
    only = *device;
  }
  auto stream = points_.Join(only, now);
  if (!stream) {
    return Problem(503,
                   "too many streams of single devices are open; use the stream of all points");
  }
  return StreamResponse(std::move(stream));
}

Response LiveApi::Map(const Request& request, Now) {
  const auto device = DeviceNamed(request.Query("device").value_or(""));
  if (!device) return Problem(404, device.error());
  const auto its = links_.store.device(*device);
  if (!its) return Problem(404, "a reload has removed this device");
  return JsonResponse(MapJson(*its));
}

Response LiveApi::TraceStream(const Request& request, Now) {
  const auto line = status::FindTarget(*config_, request.Query("line").value_or(""));
  if (!line) return Problem(404, line.error());
  std::erase_if(traces_, [](const auto& trace) { return trace.expired(); });
  if (traces_.size() >= kMostTraces)
    return Problem(503, "too many traces are open; close one of them");
  auto trace = std::make_shared<LiveTrace>(DecodersFor(*line, ""));
  const std::weak_ptr<LiveTrace> weak = trace;
  auto queue = links_.lines.Trace(line->line, [weak, &io = io_] {
    asio::post(io, [weak] {
      if (const auto self = weak.lock()) self->Wake();
    });
  });
  if (!queue) return Problem(404, "a reload has removed this line");
  trace->SetQueue(std::move(queue));
  traces_.push_back(trace);
  return StreamResponse(std::move(trace));
}

Response LiveApi::Configuration(const Request&, Now) {
  if (!links_.configuration || !links_.info.reload) {
    return Problem(
        503, "this gateway was started without a configuration file, so there is none to show");
  }
  const auto text = links_.configuration();
  if (!text) return Problem(503, text.error());
  const status::ReloadState state = links_.info.reload();
  Json json = {{"text", *text}, {"file", state.file}};
  json["confirm_until"] =
      state.confirm_until ? Json(FormatWallTime(*state.confirm_until)) : Json(nullptr);
  return JsonResponse(json);
}

Response LiveApi::Metrics(const Request&, Now now) {
  return TextResponse(200, "text/plain; version=0.0.4; charset=utf-8",
                      MetricsText(*config_, links_.store, links_.info, now));
}

void LiveApi::Acknowledge(const Request& request, const Answered& answered) {
  const auto parsed = status::ParseJson(request.body);
  if (!parsed) return answered(Problem(400, parsed.error()));
  const Json& body = *parsed;
  if (!body.is_object() || body.size() != 1) {
    return answered(Problem(400,
                            "write {\"seq\":[412,415]} with the numbers of alarms, "
                            "{\"line\":\"LINE\"} or {\"target\":\"LINE.DEVICE\"}"));
  }
  Json ask = body;
  ask["command"] = "ack";
  Ask(ask, WriterOf(request), answered);
}

void LiveApi::Ask(const Json& ask, const bus::Writer& writer, const Answered& answered) {
  const auto later = [answered](std::string text) { answered(ResponseOf(std::move(text))); };
  const control::Reply reply = handler_.Answer(
      ask.dump(-1, ' ', false, Json::error_handler_t::replace), writer, ReadClocks(), later);
  if (!reply.text.empty()) answered(ResponseOf(reply.text));
}

namespace {

std::string TextFor(const Json& value) {
  if (value.is_null()) return {};
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// Converts {"point": "LINE.DEVICE.POINT", "value": 2, "expect": 1, "confirm": true}.
Result<Json> WriteOf(const Json& body) {
  const auto is_value = [&](const char* key) {
    return body.contains(key) && body[key].is_primitive();
  };
  const bool whole = body.is_object() && body.contains("point") && body["point"].is_string() &&
                     is_value("value") && !body["value"].is_null() &&
                     (!body.contains("expect") || is_value("expect"));
  if (!whole) return Error{"write {\"point\":\"LINE.DEVICE.POINT\",\"value\":2}"};
  // A misspelt `expect` must not be a write without a condition.
  for (const auto& [key, value] : body.items()) {
    if (key != "point" && key != "value" && key != "expect" && key != "confirm") {
      return Error{Quoted(key) +
                   " is no member of a write; members: point, value, expect, confirm"};
    }
  }
  Json ask = {{"target", body["point"]}, {"value", TextFor(body["value"])}};
  if (body.contains("expect")) ask["expect"] = TextFor(body["expect"]);
  if (body.contains("confirm")) ask["confirm"] = body["confirm"];
  return ask;
}

/// Converts a body with one member, e.g. {"device": "LINE.DEVICE"}. The body of an operation about
/// the configuration can be empty, or have the member `applied`.
Result<Json> TargetOf(const Json& body, const std::string& member) {
  if (member.empty()) {
    const bool empty = body.is_discarded() || (body.is_object() && body.empty());
    if (empty) return Json::object();
    const bool applied = body.is_object() && body.size() == 1 && body.contains("applied") &&
                         body["applied"].is_string();
    return applied ? Result<Json>(body)
                   : Error{"write {} or {\"applied\":\"TIME\"}, the time of the status"};
  }
  if (body.is_object() && body.size() == 1 && body.contains(member) && body[member].is_string()) {
    return Json{{"target", body[member]}};
  }
  return Error{"write {\"" + member + "\":\"" + (member == "line" ? "LINE" : "LINE.DEVICE") +
               "\"}"};
}

}  // namespace

void LiveApi::Operate(const Operation& operation, const Request& request,
                      const Answered& answered) {
  const auto body = status::ParseJson(request.body);
  if (!body) return answered(Problem(400, body.error()));
  auto ask = operation.command == "write" ? WriteOf(*body)
                                          : TargetOf(*body, std::string(operation.member));
  if (!ask) return answered(Problem(400, ask.error()));
  (*ask)["command"] = operation.command;
  Ask(*ask, WriterOf(request), answered);
}

void LiveApi::Apply(std::shared_ptr<const config::Config> config,
                    std::shared_ptr<const history::HistorySource> history) {
  config_ = config;
  links_.info.history = history;
  handler_.Apply(std::move(config), std::move(history));
  EndStreams();
}

bool LiveApi::Tick(Now now) { return points_.watched() && points_.Tick(now); }

void LiveApi::Beat() {
  for (const auto& weak : traces_) {
    if (const auto trace = weak.lock()) trace->Beat();
  }
}

void LiveApi::EndStreams() {
  points_.EndAll();
  for (const auto& weak : traces_) {
    if (const auto trace = weak.lock()) trace->End();
  }
  traces_.clear();
}

namespace {

using status::Json;

constexpr std::array<std::string_view, 5> kPaths = {"/api/v1/events", "/api/v1/history",
                                                    "/api/v1/history.csv", "/api/v1/events.csv",
                                                    "/api/v1/writes"};
constexpr std::size_t kMostInCsv = 64;

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

/// A CSV table of events, or of the history of points, one after the other. It is read from the
/// disk page by page, as fast as the client receives it.
class PastApi::Download final : public Stream, public std::enable_shared_from_this<Download> {
 public:
  using Row = std::string (*)(const status::Json& record);
  /// `asks`: the requests for the first pages, at least one.
  Download(std::weak_ptr<PastApi*> api, asio::io_context& io, std::vector<Json> asks,
           std::string head, Row row)
      : api_(std::move(api)), io_(io), asks_(std::move(asks)), row_(row), text_(std::move(head)) {}

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
  /// Reads the next page, on PastApi's thread. A page that cannot be read ends the table; the pages
  /// before it are valid.
  void ReadPage() {
    const auto api = api_.lock();
    const Json page =
        api ? Json::parse((*api)->Page(asks_[at_], ReadClocks()), nullptr, false) : Json(nullptr);
    std::string text;
    const bool good = page.is_object() && page.contains("records");
    if (good) {
      for (const Json& record : page["records"]) text += row_(record);
      asks_[at_]["after"] = page["next"];
      if (!page.value("more", false)) ++at_;
    }
    std::function<void()> wake;
    {
      const MutexLock lock(mutex_);
      text_ = std::move(text);
      sent_ = 0;
      asked_ = false;
      ended_ = !good || at_ == asks_.size();
      wake = wake_;
    }
    if (wake) wake();
  }

  const std::weak_ptr<PastApi*> api_;
  asio::io_context& io_;
  // Requests for the next pages. Only PastApi's thread uses the following three.
  std::vector<Json> asks_;
  std::size_t at_ = 0;
  const Row row_;
  Mutex mutex_;
  std::string text_ BAUDGATE_GUARDED_BY(mutex_);
  std::size_t sent_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  bool asked_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool ended_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::function<void()> wake_ BAUDGATE_GUARDED_BY(mutex_);
};

PastApi::PastApi(const config::Config& config, const bus::PointStore& store,
                 lines::LineControl& lines, status::GatewayInfo info, asio::io_context& io)
    : io_(io), handler_(config, store, lines, no_writes_, std::move(info)) {}

bool PastApi::Has(std::string_view path) { return std::ranges::find(kPaths, path) != kPaths.end(); }

bool PastApi::Answer(const Request& request, Now now, const Answered& answered) {
  if (request.path == kPaths[0]) {
    answered(Events(request, now));
  } else if (request.path == kPaths[1]) {
    answered(History(request, now));
  } else if (request.path == kPaths[2]) {
    answered(HistoryCsv(request, now));
  } else if (request.path == kPaths[3]) {
    answered(EventsCsv(request, now));
  } else if (request.path == kPaths[4]) {
    answered(Writes(request, now));
  } else {
    return false;
  }
  return true;
}

std::string PastApi::Page(const Json& ask, Now now) {
  const std::string text = ask.dump(-1, ' ', false, Json::error_handler_t::replace);
  return handler_.Answer(text, {"web"}, now, {}).text;
}

namespace {

Result<Json> EventsAsk(const Request& request) {
  return AskOf(request, "events",
               {{"after", true},
                {"since_ms", true},
                {"until_ms", true},
                {"target"},
                {"kind"},
                {"priority"},
                {"text"}});
}

}  // namespace

Response PastApi::Events(const Request& request, Now now) {
  const auto ask = EventsAsk(request);
  if (!ask) return Problem(400, ask.error());
  return ResponseOf(Page(*ask, now));
}

Response PastApi::Writes(const Request& request, Now now) {
  const auto ask = AskOf(request, "writes", {{"after", true}, {"since_ms", true}});
  if (!ask) return Problem(400, ask.error());
  return ResponseOf(Page(*ask, now));
}

Response PastApi::EventsCsv(const Request& request, Now now) {
  const auto ask = EventsAsk(request);
  if (!ask) return Problem(400, ask.error());
  return Csv({*ask}, "events", status::EventsCsvHead(), status::EventsCsvRow, now);
}

/// Returns a table of all pages. The first page of each request is read before, so that an error
/// has its HTTP status.
Response PastApi::Csv(std::vector<Json> asks, std::string name, std::string head,
                      std::string (*row)(const Json& record), Now now) {
  for (const Json& ask : asks) {
    const std::string first = Page(ask, now);
    if (first.starts_with(kError)) return ResponseOf(first);
  }
  std::erase_if(name, [](char c) { return c == '"' || c == '\\' || c < 0x21 || c > 0x7E; });
  Response response;
  response.type = "text/csv; charset=utf-8";
  response.headers.emplace_back("Content-Disposition", "attachment; filename=\"" + name + ".csv\"");
  response.stream = std::make_shared<Download>(alive_, io_, std::move(asks), std::move(head), row);
  return response;
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
    return Problem(400,
                   "'pixels' must be a number from 1 to " + std::to_string(history::kMostPixels));
  }
  constexpr history::Millis kMost = 20 * 366 * history::kDay;
  if (query.since >= query.until || query.until - query.since > kMost || query.since < 0) {
    return Problem(400, "'since_ms' must be before 'until_ms', by at most twenty years");
  }
  // If there is no history, the answer to the control command "history" contains the reason.
  const auto gateway = handler_.gateway();
  if (!gateway->info.history)
    return ResponseOf(Page({{"command", "history"}, {"point", query.point}}, now));
  const auto chart = history::ReadChart(*gateway->info.history, query);
  if (!chart) return Problem(503, "the history cannot be read: " + chart.error());
  const config::Point* const point = status::PointNamed(*gateway->config, query.point);
  if (!chart->known) {
    const std::string page = Page({{"command", "history"}, {"point", query.point}}, now);
    if (page.starts_with("{\"error\"")) return ResponseOf(page);
  }
  return JsonResponse({{"point", query.point},
                       {"unit", point != nullptr ? point->unit : ""},
                       {"step_ms", chart->step},
                       {"rows", RowsJson(*chart)}});
}

Response PastApi::HistoryCsv(const Request& request, Now now) {
  const auto ask = AskOf(request, "history", {{"point"}, {"since_ms", true}, {"until_ms", true}});
  if (!ask) return Problem(400, ask.error());
  const std::string names = ask->value("point", "");
  const auto points = Split(names, ',');
  if (points.size() > kMostInCsv) {
    return Problem(400, "'point' can name at most " + std::to_string(kMostInCsv) + " points");
  }
  std::vector<Json> asks;
  for (const std::string_view point : points) {
    asks.push_back(*ask);
    asks.back()["point"] = point;
  }
  return Csv(
      std::move(asks), points.size() == 1 ? names : "history", status::HistoryCsvHead(false),
      [](const Json& record) { return status::HistoryCsvRow(record, false); }, now);
}

}  // namespace baudgate::web
