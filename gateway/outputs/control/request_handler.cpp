// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/request_handler.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/outputs/control/record_requests.h"

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

namespace {

using Type = Member::Type;

bool IsWhole(const Json& value) {
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (value.is_number_unsigned()) return value.get<std::uint64_t>() <= kMost;
  return value.is_number_integer();
}

bool Is(Type type, const Json& value) {
  switch (type) {
    case Type::text:
      return value.is_string();
    case Type::flag:
      return value.is_boolean();
    case Type::whole:
      return IsWhole(value);
    case Type::two_wholes:
      break;
  }
  return value.is_array() && value.size() == 2 && std::all_of(value.begin(), value.end(), IsWhole);
}

std::string_view Words(Type type) {
  constexpr std::array<std::string_view, 4> kWords = {"a text in quotation marks", "true or false",
                                                      "a whole number", "two whole numbers in [ ]"};
  return kWords[static_cast<std::size_t>(type)];
}

/// Short enough for a sentence, whatever a client sends.
std::string Shown(const Json& value) {
  constexpr std::size_t kMost = 40;
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > kMost) text = text.substr(0, kMost) + "…";
  return text;
}

}  // namespace

Status CheckShape(const Command& command, const Json& request) {
  std::vector<std::string_view> names;
  for (const Member& member : command.members) names.push_back(member.name);
  for (const auto& [name, value] : request.items()) {
    if (name == "command") continue;
    const auto member = std::ranges::find(command.members, name, &Member::name);
    if (member == command.members.end()) {
      return Error{config::Quoted(name) + " is no member of " + config::Quoted(command.name) + ";" +
                   config::DidYouMean(name, names) +
                   (names.empty() ? " it has none" : " there are: " + config::Join(names))};
    }
    if (Is(member->type, value)) continue;
    return Error{config::Quoted(name) + " of " + config::Quoted(command.name) + " is " +
                 std::string(Words(member->type)) + ", and not " + Shown(value)};
  }
  return {};
}

namespace {

constexpr std::string_view kLate =
    "the disk of the records does not answer in time; look at the disk (dmesg)";

}  // namespace

RecordReader::RecordReader() : worker_("records", [this](bool last) { return Round(last); }) {
  worker_.Start();
}

Reply RecordReader::Ask(const Command& command, std::shared_ptr<const Gateway> gateway,
                        Json request, Writer client, Now now,
                        std::function<void(std::string text)> later) {
  if (!queue_.Put({&command, std::move(gateway), std::move(request), std::move(client), now,
                   std::move(later)})) {
    return Refused(kUnavailable, kLate);
  }
  worker_.Wake();
  return {.text = {}, .late = ErrorLine(kUnavailable, kLate)};
}

Instant RecordReader::Round(bool last) {
  if (last) return kWhenWoken;
  const auto job = queue_.Take();
  if (!job) return kWhenWoken;
  Reply reply = job->command->answer(*job->gateway, {job->request, job->client, job->now, {}});
  job->later(std::move(reply.text));
  return {};
}

namespace {

/// For `baudgate` itself, which asks for the points of a pattern: people have `history`.
constexpr std::string_view kNotListed = "kept_points";

std::string NoCommand(const std::string& name) {
  std::vector<std::string_view> names;
  for (const Command& command : Commands()) {
    if (command.name != kNotListed) names.push_back(command.name);
  }
  return config::Quoted(name) + " is no command;" + config::DidYouMean(name, names) +
         " there are: " + config::Join(names);
}

}  // namespace

RequestHandler::RequestHandler(const config::Config& config, const PointStore& store,
                               LineControl& control, CommandSink& sink, GatewayInfo info)
    : points_(store, sink, [audit = info.audit] { return audit::PastOf(audit); }),
      gateway_(std::make_shared<Gateway>(Gateway{
          {std::shared_ptr<void>(), &config}, store, control, sink, std::move(info), points_})) {}

Reply RequestHandler::Answer(std::string_view request, const Writer& client, Now now,
                             const Later& later) {
  const Json json = Json::parse(request, nullptr, false);
  if (!json.is_object()) {
    return Refused(kUsage,
                   "a request is one JSON object in one line, for example "
                   "{\"command\":\"status\"}");
  }
  const std::string name = TextOf(json, "command");
  const auto command = std::ranges::find(Commands(), name, &Command::name);
  if (command == Commands().end()) return Refused(kUsage, NoCommand(name));
  if (const Status shape = CheckShape(*command, json); !shape) {
    return Refused(kUsage, shape.error());
  }
  const auto present = gateway();
  if (command->reads_disk && reader_) {
    return reader_->Ask(*command, present, json, client, now, later);
  }
  return command->answer(
      *present, {json, client, now, [later](const Json& answer) { later(OneLine(answer)); }});
}

template <typename Change>
void RequestHandler::Renew(Change change) {
  const MutexLock lock(mutex_);
  auto next = std::make_shared<Gateway>(*gateway_);
  change(*next);
  gateway_ = std::move(next);
}

void RequestHandler::SetReload(ReloadService& service) {
  Renew([&](Gateway& next) { next.reload = &service; });
}

void RequestHandler::Apply(std::shared_ptr<const config::Config> config,
                           std::shared_ptr<const history::HistorySource> history) {
  Renew([&](Gateway& next) {
    next.config = std::move(config);
    next.info.history = std::move(history);
  });
}

void RequestHandler::ReadApart() { reader_ = std::make_unique<RecordReader>(); }

}  // namespace baudgate::control
