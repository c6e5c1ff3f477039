// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/commands.h"

#include "gateway/outputs/control/line_requests.h"
#include "gateway/outputs/control/record_requests.h"
#include "gateway/outputs/control/telegram_requests.h"

namespace baudgate::control {
namespace {

constexpr std::string_view kNoFile =
    "this gateway was not started with a file, which could be read";
constexpr Duration kMostConfirm = 24h;

ReloadService::Answered Answer(const Request& request) {
  return [later = request.later](const ReloadAnswer& end) {
    later({{"ok", end.ok},
           {"applied", end.applied},
           {"exit", end.exit_code},
           {"changes", end.changes},
           {"warnings", end.warnings},
           {"text", end.text},
           {"confirm_ms", end.confirm / 1ms}});
  };
}

Reply Reload(const Gateway& gateway, const Request& request) {
  if (gateway.reload == nullptr) return Refused(kUnavailable, kNoFile);
  ReloadAsk ask;
  ask.dry_run = request.json.value("dry_run", false);
  const std::int64_t confirm_ms = NumberOf(request.json, "confirm_ms").value_or(0);
  const bool given = request.json.contains("confirm_ms");
  if (given && (confirm_ms < 1000 || confirm_ms > kMostConfirm / 1ms)) {
    return Refused(kUsage, "a confirmation is awaited for a time from 1s to 24h");
  }
  ask.confirm = std::chrono::milliseconds(confirm_ms);
  ask.by = request.client.name;
  gateway.reload->Reload(ask, Answer(request));
  return {};
}

Reply Confirm(const Gateway& gateway, const Request& request) {
  if (gateway.reload == nullptr) return Refused(kUnavailable, kNoFile);
  gateway.reload->Confirm(request.client.name, Answer(request));
  return {};
}

/// Once it is asked, the line answers.
Reply Asked(const Status& status) { return status ? Reply{} : Refused(kUnknown, status.error()); }

Reply Read(const Gateway& gateway, const Request& request) {
  return Asked(gateway.points.Read(*gateway.config, request.json, request.client, request.now,
                                   request.later));
}

Reply Write(const Gateway& gateway, const Request& request) {
  return Asked(gateway.points.Write(*gateway.config, request.json, request.client,
                                    request.now.instant, request.later));
}

Reply MayWrite(const Gateway& gateway, const Request& request) {
  const auto answer = gateway.points.MayWrite(*gateway.config, request.json, request.now.instant);
  return answer ? Reply{OneLine(*answer)} : Refused(kUnknown, answer.error());
}

Reply Ask(const Gateway& gateway, const Request& request) {
  return Asked(AskManually(*gateway.config, gateway.control, gateway.sink, request.json,
                           request.client, request.now.instant, request.later));
}

}  // namespace

const std::vector<Command>& Commands() {
  using enum Member::Type;
  static const std::vector<Command> commands = {
      {"status", {{"target"}}, ShowStatus},
      {"read", {{"target"}}, Read},
      {"write", {{"target"}, {"value"}, {"confirm", flag}, {"client"}, {"seq", whole}}, Write},
      {"may_write", {{"target"}, {"value"}}, MayWrite},
      {"ask", {{"target"}, {"telegram"}, {"write", flag}}, Ask},
      {"writes", {{"after", whole}, {"since_ms", whole}, {"order"}}, ShowWrites, true},
      {"events", {{"after", whole}, {"since_ms", whole}, {"target"}}, ShowEvents, true},
      {"alarms", {{"after", whole}}, ShowAlarms},
      {"history",
       {{"point"},
        {"after", two_wholes},
        {"since_ms", whole},
        {"until_ms", whole},
        {"every_ms", whole}},
       ShowHistory,
       true},
      {"kept_points", {{"pattern"}}, ShowKeptPoints},
      {"ack", {{"target"}}, Acknowledge},
      {"settings", {{"target"}}, ShowSettings},
      {"release", {{"target"}, {"for_ms", whole}, {"tcp"}, {"rfc2217", flag}, {"allow"}}, Release},
      {"take_back", {{"target"}}, TakeBack},
      {"enable", {{"target"}}, Enable},
      {"disable", {{"target"}}, Disable},
      {"trace", {{"target"}, {"device"}}, Trace},
      {"recorded", {{"target"}, {"device"}}, ShowRecorded},
      {"reload", {{"dry_run", flag}, {"confirm_ms", whole}}, Reload},
      {"confirm", {}, Confirm},
  };
  return commands;
}

}  // namespace baudgate::control
