// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/live_api.h"

#include <asio/post.hpp>
#include <utility>

#include "gateway/outputs/status/target.h"
#include "gateway/outputs/web/map_json.h"
#include "gateway/outputs/web/metrics.h"
#include "gateway/outputs/web/points_json.h"

namespace baudgate::web {
namespace {

using control::Json;

Response StreamResponse(std::shared_ptr<Stream> stream) {
  Response response;
  response.type = "text/event-stream";
  response.stream = std::move(stream);
  response.headers.emplace_back("X-Accel-Buffering", "no");  // nginx would keep the first 4 KB
  return response;
}

}  // namespace

LiveApi::LiveApi(const config::Config& config, Links links, asio::io_context& io)
    : config_(std::shared_ptr<void>(), &config),
      links_(std::move(links)),
      io_(io),
      handler_(config, links_.store, links_.lines, no_writes_, links_.info),
      points_(links_.store, links_.info.events) {}

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
  return ResponseOf(handler_.Answer(text, {"web:" + request.peer}, now, {}).text);
}

Response LiveApi::Status(const Request& request, Now now) {
  return Asked(request, "status", {{"target"}}, now);
}

Response LiveApi::Alarms(const Request& request, Now now) {
  return Asked(request, "alarms", {{"after", true}}, now);
}

Response LiveApi::Recorded(const Request& request, Now now) {
  Response raw = Asked(request, "recorded", {{"line", false, "target"}, {"device"}}, now);
  const auto line = control::FindTarget(*config_, request.Query("line").value_or(""));
  if (raw.status != 200 || !line) return raw;
  Json answer = Json::parse(raw.body, nullptr, false);
  FrameLines frames(DecodersFor(*line, request.Query("device").value_or("")));
  Json lines = Json::array();
  const auto add = [&lines](const std::vector<std::string>& whole) {
    for (const std::string& frame : whole) lines.push_back(frame);
  };
  for (const Json& record : answer["records"]) add(frames.Take(record.get<std::string>()));
  add(frames.Flush());
  answer["records"] = std::move(lines);
  return JsonResponse(answer);
}

Decoders LiveApi::DecodersFor(const control::Target& target, const std::string& device) const {
  if (!links_.protocol) return {};
  return DecodersOf(config_->lines[target.line], links_.protocol, device);
}

Result<std::uint32_t> LiveApi::DeviceNamed(const std::string& name) const {
  if (name.empty()) return Error{"name one device: ?device=LINE.DEVICE"};
  const auto target = control::FindTarget(*config_, name);
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
    const auto line = control::FindTarget(*config_, filter.line);
    if (!line) return Problem(404, line.error());
  }
  if (const auto name = request.Query("device")) {
    const auto device = DeviceNamed(*name);
    if (!device) return Problem(404, device.error());
    filter.device = *device;
  }
  return JsonResponse(PointsJson(links_.store, filter, now));
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
    return Problem(503, "too many devices are looked at one by one; take the stream of all points");
  }
  return StreamResponse(std::move(stream));
}

Response LiveApi::Map(const Request& request, Now) {
  const auto device = DeviceNamed(request.Query("device").value_or(""));
  if (!device) return Problem(404, device.error());
  return JsonResponse(MapJson(links_.store.device(*device)));
}

Response LiveApi::TraceStream(const Request& request, Now) {
  const auto line = control::FindTarget(*config_, request.Query("line").value_or(""));
  if (!line) return Problem(404, line.error());
  std::erase_if(traces_, [](const auto& trace) { return trace.expired(); });
  if (traces_.size() >= kMostTraces) return Problem(503, "too many traces are looked at");
  auto trace = std::make_shared<LiveTrace>(DecodersFor(*line, ""));
  const std::weak_ptr<LiveTrace> weak = trace;
  auto queue = links_.lines.Trace(line->line, [weak, &io = io_] {
    asio::post(io, [weak] {
      if (const auto self = weak.lock()) self->Wake();
    });
  });
  if (!queue) return Problem(404, "the line has ended this moment");
  trace->SetQueue(std::move(queue));
  traces_.push_back(trace);
  return StreamResponse(std::move(trace));
}

Response LiveApi::Configuration(const Request&, Now) {
  if (!links_.configuration || !links_.info.reload) {
    return Problem(503, "this gateway was not started with a file");
  }
  const auto text = links_.configuration();
  if (!text) return Problem(503, text.error());
  const control::ReloadState state = links_.info.reload();
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
  const Json body = Json::parse(request.body, nullptr, false);
  if (!body.is_object() || !body.contains("target") || !body["target"].is_string()) {
    return answered(Problem(400, "write {\"target\":\"LINE.DEVICE\"}, or the number of an event"));
  }
  const Json ask = {{"command", "ack"}, {"target", body["target"]}};
  const auto later = [answered](std::string text) { answered(ResponseOf(std::move(text))); };
  const std::string text = ask.dump(-1, ' ', false, Json::error_handler_t::replace);
  const control::Reply reply = handler_.Answer(text, {"web:" + request.peer}, ReadClocks(), later);
  if (!reply.text.empty()) answered(ResponseOf(reply.text));
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

}  // namespace baudgate::web
