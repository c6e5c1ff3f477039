// SPDX-License-Identifier: Apache-2.0
#include "gateway/control/request_handler.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "gateway/audit/audit_source.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"
#include "gateway/control/alarm_requests.h"
#include "gateway/control/history_requests.h"
#include "gateway/control/request_shape.h"
#include "gateway/control/request_text.h"
#include "gateway/control/telegram_requests.h"
#include "gateway/events/event_source.h"
#include "gateway/status/audit_json.h"
#include "gateway/status/events_json.h"
#include "gateway/status/settings_json.h"
#include "gateway/trace/trace_head.h"

namespace baudgate::control {
namespace {

/// Bytes of a device may stand in a reason; what is no UTF-8 must not end in an exception.
std::string Dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Reply Refused(std::string_view kind, std::string_view message) {
  return {ErrorLine(kind, message)};
}

std::optional<WallTime> SinceOf(const Json& request) { return TimeOf(request, "since_ms"); }

constexpr Duration kMostConfirm = 24h;

Json Done(const config::Line& line) { return {{"ok", true}, {"line", line.name}}; }

/// Where clients may have the port of this line, as `release --tcp` asks for it.
Result<config::PortServer> OfferedAt(const Json& request, const config::Line& line) {
  if (line.serial_server) {
    return Error{"clients have the port of line '" + line.name + "' at " +
                 line.serial_server->Place() + " already (serial_server)"};
  }
  const std::string text = TextOf(request, "tcp");
  const std::string allow = TextOf(request, "allow");
  auto at = config::ParseHostPort(text);
  if (at && at->host == "localhost") at->host = "127.0.0.1";
  if (!at || !config::IsIpAddress(at->host)) {
    return Error{config::Quoted(text) +
                 " is not ADDRESS:PORT of this machine; write for example "
                 "127.0.0.1:4001"};
  }
  config::PortServer server;
  server.at = *at;
  if (request.value("rfc2217", false)) server.mode = config::PortServer::Mode::rfc2217;
  if (line.lend && line.lend->at == server.at) {
    return Error{"line '" + line.name + "' is lent at " + server.Place() + " already (lend)"};
  }
  for (const std::string_view range : Split(allow, ' ')) {
    if (range.empty()) continue;
    auto network = config::ParseNetwork(range);
    if (!network) return Error{network.error()};
    server.allow.push_back(*std::move(network));
  }
  if (server.allow.empty() && !server.on_loopback()) {
    return Error{"whoever reaches " + server.Place() +
                 " from other machines could write to the devices of the line; say with --allow "
                 "ADDRESS who may come in"};
  }
  return server;
}

/// Why the port cannot be released now, if somebody has it already.
std::optional<std::string> InUse(const config::Line& line, const LineStatus& status, bool by_tcp) {
  const std::string end = "; 'baudgate release " + line.name + " --end' takes it back";
  for (const PortService& service : status.services) {
    if (service.visit && service.visit->why.empty()) {
      return "client " + service.visit->client + " has the port of line '" + line.name + "' at " +
             service.place + end;
    }
  }
  const bool released = status.port == LineStatus::Port::released && !status.lent_to_client;
  if (!by_tcp || !released) return std::nullopt;
  return "the port of line '" + line.name + "' is released to another program until " +
         FormatWallTime(status.released_until) + end;
}

}  // namespace

std::string ErrorLine(std::string_view kind, std::string_view message) {
  return Dump(ErrorJson(kind, message));
}

std::string RecordLine(const TraceRecord& record) { return Dump({{"record", ToText(record)}}); }

bool Wanted(const TraceWish& wish, const TraceRecord& record) {
  return wish.device.empty() || record.device.empty() || record.device == wish.device;
}

RequestHandler::RequestHandler(const config::Config& config, const PointStore& store,
                               LineControl& control, CommandSink& sink, GatewayInfo info)
    : config_(&config),
      store_(store),
      control_(control),
      sink_(sink),
      info_(std::move(info)),
      points_(config, store, sink) {}

Reply RequestHandler::Answer(std::string_view request, const Writer& client, Now now,
                             const Later& later) {
  const Json json = Json::parse(request, nullptr, false);
  if (!json.is_object()) {
    return Refused(kUsage,
                   "a request is one JSON object in one line, for example "
                   "{\"command\":\"status\"}");
  }
  return Dispatch(json, client, now, later);
}

Reply RequestHandler::Dispatch(const Json& request, const Writer& client, Now now,
                               const Later& later) {
  const std::string command = TextOf(request, "command");
  if (const Status shape = CheckShape(command, request); !shape) {
    return Refused(kUsage, shape.error());
  }
  if (command == "status") {
    std::optional<Target> target;
    if (request.contains("target")) {
      const auto found = TargetOf(request);
      if (!found) return Refused(kUnknown, found.error());
      target = *found;
    }
    return {Dump(StatusJson(*config_, store_, info_, target, now))};
  }
  if (command == "settings") return Settings(request, now);
  if (command == "may_write") {
    const auto answer = points_.MayWrite(request, now.instant);
    return answer ? Reply{Dump(*answer)} : Refused(kUnknown, answer.error());
  }
  if (command == "release") return Release(request, now);
  if (command == "take_back") return TakeBack(request);
  if (command == "enable") return SetInUse(request, true);
  if (command == "disable") return SetInUse(request, false);
  if (command == "trace") return Trace(request, false);
  if (command == "recorded") return Trace(request, true);
  if (command == "writes") return Writes(request);
  if (command == "events") return Events(request);
  if (command == "alarms") return Alarms(request);
  if (command == "history") return {Dump(HistoryPage(request, Kept()))};
  if (command == "kept_points") return {Dump(KeptPoints(request, Kept()))};
  const auto answered = [later](const Json& answer) { later(Dump(answer)); };
  if (command == "ack") return Acknowledge(request, client, answered);
  if (command == "reload") return Reload(request, client, false, answered);
  if (command == "confirm") return Reload(request, client, true, answered);
  if (command == "ask") {
    const Status status =
        AskByHand(*config_, control_, sink_, request, client, now.instant, answered);
    return status ? Reply{} : Refused(kUnknown, status.error());
  }
  if (command == "read" || command == "write") {
    const Status status = command == "read" ? points_.Read(request, client, now, answered)
                                            : points_.Write(request, client, now.instant, answered);
    return status ? Reply{} : Refused(kUnknown, status.error());
  }
  constexpr std::string_view kCommands[] = {
      "status",  "read",    "write",    "may_write", "ask",     "writes",    "events",
      "alarms",  "history", "ack",      "settings",  "release", "take_back", "enable",
      "disable", "trace",   "recorded", "reload",    "confirm"};
  return Refused(kUsage, config::Quoted(command) + " is no command;" +
                             config::DidYouMean(command, kCommands) +
                             " there are: " + config::Join(kCommands));
}

Result<Target> RequestHandler::TargetOf(const Json& request) const {
  return FindTarget(*config_, TextOf(request, "target"));
}

Result<Target> RequestHandler::LineOf(const Json& request) const {
  const auto target = TargetOf(request);
  if (!target || !target->device) return target;
  const std::string& line = config_->lines[target->line].name;
  return Error{config::Quoted(TextOf(request, "target")) +
               " is one device; this is done with a line as a whole: write " + line};
}

Result<Target> RequestHandler::DeviceOf(const Json& request) const {
  const auto target = TargetOf(request);
  if (!target || target->device) return target;
  return Error{"name one device: " + config_->lines[target->line].name + ".DEVICE"};
}

Reply RequestHandler::Release(const Json& request, Now now) {
  const auto target = LineOf(request);
  if (!target) return Refused(kUnknown, target.error());
  const auto found = request.find("for_ms");
  const bool whole = found != request.end() && found->is_number_unsigned();
  const auto most = static_cast<std::uint64_t>(kMostRelease / 1ms);
  const std::uint64_t wanted = whole ? found->get<std::uint64_t>() : 0;
  if (wanted < 1000 || wanted > most) {
    return Refused(kUsage, "a port is lent for a time from 1s to 24h");
  }
  const Duration time = std::chrono::milliseconds(wanted);
  const config::Line& line = config_->lines[target->line];
  Json done = Done(line);
  const bool by_tcp = request.contains("tcp");
  if (const auto in_use = InUse(line, store_.ReadLine(target->line), by_tcp)) {
    return Refused(kUsage, *in_use);
  }
  if (by_tcp) {
    const auto server = OfferedAt(request, line);
    if (!server) return Refused(kUsage, server.error());
    control_.Offer(target->line, *server, time);
    done["at"] = server->Place();
  } else {
    control_.Release(target->line, time);
  }
  done["port"] = line.port;
  done["until"] = FormatWallTime(now.wall + time);
  return {Dump(done)};
}

Reply RequestHandler::TakeBack(const Json& request) {
  const auto target = LineOf(request);
  if (!target) return Refused(kUnknown, target.error());
  Json done = Done(config_->lines[target->line]);
  const LineStatus status = store_.ReadLine(target->line);
  done["was_released"] = status.port == LineStatus::Port::released ||
                         std::ranges::any_of(status.services, [](const PortService& service) {
                           return service.open_until != WallTime{};
                         });
  control_.TakeBack(target->line);
  return {Dump(done)};
}

Reply RequestHandler::Settings(const Json& request, Now now) const {
  const auto target = DeviceOf(request);
  if (!target) return Refused(kUnknown, target.error());
  const auto settings = SettingsJson(*config_, store_, *target, now);
  if (!settings) return Refused(kUnknown, settings.error());
  return {Dump(*settings)};
}

Reply RequestHandler::SetInUse(const Json& request, bool in_use) {
  const auto target = DeviceOf(request);
  if (!target) return Refused(kUnknown, target.error());
  control_.SetInUse(*target->device, in_use);
  Json done = Done(config_->lines[target->line]);
  done["device"] = store_.device(*target->device).name;
  done["in_use"] = in_use;
  done["enabled"] = store_.device(*target->device).enabled;
  return {Dump(done)};
}

Reply RequestHandler::Trace(const Json& request, bool recorded) {
  const auto target = LineOf(request);
  if (!target) return Refused(kUnknown, target.error());
  TraceWish wish{target->line, TextOf(request, "device")};
  if (!wish.device.empty()) {
    const auto device = FindDevice(*config_, target->line, wish.device);
    if (!device) return Refused(kUnknown, device.error());
  }
  Json done = Done(config_->lines[target->line]);
  done["head"] = TraceHead(config_->lines[target->line]);
  if (!recorded) return {Dump(done), wish};
  Json& records = done["records"] = Json::array();
  for (const TraceRecord& record : control_.Recorded(target->line)) {
    if (Wanted(wish, record)) records.push_back(ToText(record));
  }
  return {Dump(done)};
}

/// One page; the client asks for the next with what this one says.
Reply RequestHandler::Writes(const Json& request) {
  if (info_.audit == nullptr) {
    return Refused(
        kUnavailable,
        "nothing of this gateway can be written, so there are no records of writes: no "
        "device has 'write: allow', no line has 'ask: write', and no route can be written through");
  }
  audit::PageQuery query;
  if (TextOf(request, "order") == "settled") query.order = audit::PageQuery::Order::settled;
  query.after = NumberOf(request, "after").value_or(0);
  query.since = SinceOf(request);
  const audit::AuditState state = info_.audit->state();  // before the page: it may open meanwhile
  const auto page = info_.audit->Read(query);
  if (!page) return Refused(kUnavailable, "the records of writes cannot be read: " + page.error());
  Json json = PageJson(*page);
  json["audit"] = AuditJson(state);
  return {Dump(json)};
}

/// One page, as of writes. A device that is not configured any more still has its events.
Reply RequestHandler::Events(const Json& request) {
  if (!KeepsEvents()) return Refused(kUnavailable, kNoEvents);
  events::PageQuery query;
  query.after = NumberOf(request, "after").value_or(0);
  query.since = SinceOf(request);
  const std::string target = TextOf(request, "target");
  const std::size_t dot = target.find('.');
  if (dot != std::string::npos) query.line = target.substr(0, dot);
  query.device = dot == std::string::npos ? target : target.substr(dot + 1);
  const events::EventsState state = info_.events->state();  // before the page, as above
  const auto page = info_.events->Read(query);
  if (!page) return Refused(kUnavailable, "the events cannot be read: " + page.error());
  if (page->records.empty() && !target.empty()) {
    if (const Status known = KnowsDevice(*config_, query.line, query.device); !known) {
      return Refused(kUnknown, known.error());
    }
  }
  Json json = PageJson(*page);
  json["events"] = EventsJson(state);
  return {Dump(json)};
}

Reply RequestHandler::Alarms(const Json& request) {
  if (info_.events == nullptr) return Refused(kUnavailable, kNoEvents);
  const events::EventsState state = info_.events->state();  // before the page, as above
  Json json = AlarmsPage(*info_.events, NumberOf(request, "after").value_or(0));
  json["events"] = EventsJson(state);
  return {Dump(json)};
}

Reply RequestHandler::Acknowledge(const Json& request, const Writer& client,
                                  const std::function<void(const Json&)>& answered) {
  if (info_.events == nullptr) return Refused(kUnavailable, kNoEvents);
  auto query = FindAlarms(*config_, *info_.events, TextOf(request, "target"));
  if (!query) return Refused(kUnknown, query.error());
  query->by = client.name;
  info_.events->Acknowledge(
      *query, [answered](const events::Acknowledged& done) { answered(AckJson(done)); });
  return {};
}

Reply RequestHandler::Reload(const Json& request, const Writer& client, bool confirm,
                             const std::function<void(const Json&)>& answered) {
  if (reload_ == nullptr) {
    return Refused(kUnavailable, "this gateway was not started with a file, which could be read");
  }
  const auto answer = [answered](const ReloadAnswer& end) {
    answered({{"ok", end.ok},
              {"applied", end.applied},
              {"exit", end.exit_code},
              {"changes", end.changes},
              {"text", end.text},
              {"confirm_ms", end.confirm / 1ms}});
  };
  if (confirm) {
    reload_->Confirm(client.name, answer);
    return {};
  }
  ReloadAsk ask;
  const auto dry = request.find("dry_run");
  ask.dry_run = dry != request.end() && dry->is_boolean() && dry->get<bool>();
  const std::int64_t confirm_ms = NumberOf(request, "confirm_ms").value_or(0);
  const bool given = request.contains("confirm_ms");
  if (given && (confirm_ms < 1000 || confirm_ms > kMostConfirm / 1ms)) {
    return Refused(kUsage, "a confirmation is awaited for a time from 1s to 24h");
  }
  ask.confirm = std::chrono::milliseconds(confirm_ms);
  ask.by = client.name;
  reload_->Reload(ask, answer);
  return {};
}

bool RequestHandler::KeepsEvents() const {
  return info_.events != nullptr && !info_.events->state().in_memory;
}

}  // namespace baudgate::control
