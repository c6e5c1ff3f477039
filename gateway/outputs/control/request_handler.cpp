// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/request_handler.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/outputs/control/record_requests.h"
#include "gateway/outputs/status/target.h"
#include "gateway/records/trace/trace_text.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"

namespace baudgate::control {
namespace {

/// The longest time for which one request releases a port. To extend it, the client sends the
/// request again.
constexpr Duration kMostRelease = 24h;
constexpr Duration kHandPatience = 8s;

struct Addressed {
  const config::Line* line = nullptr;
  const config::Device* device = nullptr;
  std::uint32_t index = 0;
};

/// Finds the device that `target` names. If `target` is a line, returns the line's first device
/// that uses the line's protocol.
Result<Addressed> AddressOf(const config::Config& config, const status::Json& request) {
  const auto target = status::FindTarget(config, TextOf(request, "target"));
  if (!target) return Error{target.error()};
  const config::Line& line = config.lines[target->line];
  for (const config::Device& device : line.devices) {
    const auto found = status::FindDevice(config, target->line, device.name);
    if (!found || !found->device) continue;
    const bool wanted =
        target->device ? *target->device == *found->device : device.protocol == line.protocol;
    if (wanted) return Addressed{&line, &device, *found->device};
  }
  return Error{"line '" + line.name +
               "' has no device with the protocol of the line; add a device, or release the line "
               "and use 'ask' on its port"};
}

Status Allows(const Addressed& to, bool reads, bool confirmed) {
  if (reads) return {};
  const std::string telegram = "this telegram may write: ";
  if (to.line->ask != config::Ask::write) {
    return Error{telegram + "line '" + to.line->name +
                 "' sends such a telegram only with 'ask: write' in its configuration"};
  }
  if (!confirmed) return Error{telegram + "add --write to send it"};
  return {};
}

// AskManually sends telegrams that a person has entered ("by hand"). The protocol of the line
// completes and checks a telegram. The telegram is allowed or denied, recorded if it can write, and
// sent when the line's queue reaches it.
//
//   {"command":"ask","target":"bay","telegram":"3E 31 52 46 3A"}
//   {"sent":"3E 31 52 46 3A 32 31 0D","received":"0A 3C …","outcome":"ok","reason":""}
//
// "sent" is empty if nothing was sent; "reason" then contains the cause.

/// `target`: LINE or LINE.DEVICE, whose protocol and options are used; `telegram`: hex digits,
/// which the protocol completes, e.g. by a checksum; `write` true: the client agrees that the
/// telegram may write. If AskManually returns an error (one sentence), `answered` is not called;
/// else it is called once, on any thread. All references must stay valid until then.
Status AskManually(const config::Config& config, lines::LineControl& control,
                   bus::CommandSink& sink, const status::Json& request, const bus::Writer& writer,
                   Instant now, const std::function<void(const status::Json&)>& answered) {
  const auto to = AddressOf(config, request);
  if (!to) return Error{to.error()};
  const protocols::Protocol* protocol = control.FindProtocol(to->device->protocol);
  if (protocol == nullptr || protocol->telegram == nullptr ||
      SpeaksUnasked(*protocol, to->device->options)) {
    return Error{"telegrams by hand are not supported for " + to->device->protocol};
  }
  const auto written = ParseHex(TextOf(request, "telegram"));
  if (!written || written->empty())
    return Error{"'telegram' must be bytes in hex, for example 3E 31 52 46 3A"};
  const protocols::ParsedOptions options = ParseOptions(*protocol, to->device->options);
  const auto bytes = protocol->telegram->complete(*written, options);
  if (!bytes) return Error{bytes.error()};
  const auto flag = request.find("write");
  const bool confirmed = flag != request.end() && flag->is_boolean() && flag->get<bool>();
  auto telegram = std::make_shared<bus::Telegram>();
  telegram->bytes = *bytes;
  telegram->reads = protocol->telegram->is_read(*bytes, options);
  telegram->shown = MaskedHex(*bytes, protocol->expect(*bytes, options));
  if (Status allowed = Allows(*to, telegram->reads, confirmed); !allowed) {
    sink.OnNotTaken({.client = writer.name,
                     .device = to->index,
                     .value = telegram->shown,
                     .reason = allowed.error()});
    return allowed;
  }
  bus::WriteCommand command;
  command.device = to->index;
  command.client = writer.name;
  command.kind = telegram;
  command.deadline = now + kHandPatience;
  command.abandoned = writer.left;
  const status::Json head = {{"protocol", protocol->name},
                             {"sent", telegram->shown},
                             {"write", !telegram->reads},
                             {"device", to->device->name},
                             {"head", records::TraceHead(*to->line)}};
  command.done = [answered, telegram, head](const WriteResult& result) {
    status::Json json = head;
    if (result.end == WriteEnd::not_sent || result.end == WriteEnd::denied) json["sent"] = "";
    json["received"] = ToHex(telegram->reply);
    json["outcome"] = telegram->outcome.empty() ? std::string(Name(result.end)) : telegram->outcome;
    json["reason"] = result.reason;
    answered(json);
  };
  if (!sink.Submit(std::move(command)))
    return Error{"nothing was sent, because too many commands wait for the line; try again"};
  return {};
}

status::Json Done(const config::Line& line) { return {{"ok", true}, {"line", line.name}}; }

Result<config::PortServer> OfferedAt(const status::Json& request, const config::Line& line) {
  if (line.serial_server) {
    return Error{"the port of line '" + line.name + "' is already served to clients at " +
                 line.serial_server->Address() + " (serial_server)"};
  }
  const std::string text = TextOf(request, "tcp");
  const std::string allow = TextOf(request, "allow");
  auto at = config::ParseHostPort(text);
  if (at && at->host == "localhost") at->host = "127.0.0.1";
  if (!at || !config::IsIpAddress(at->host)) {
    return Error{Quoted(text) +
                 " is not ADDRESS:PORT of this machine; write for example "
                 "127.0.0.1:4001"};
  }
  config::PortServer server;
  server.at = *at;
  if (request.value("rfc2217", false)) server.mode = config::PortServer::Mode::rfc2217;
  if (line.lend && line.lend->at == server.at) {
    return Error{"line '" + line.name + "' is already lent at " + server.Address() + " (lend)"};
  }
  for (const std::string_view range : Split(allow, ' ')) {
    if (range.empty()) continue;
    auto network = config::ParseNetwork(range);
    if (!network) return Error{network.error()};
    server.allow.push_back(*std::move(network));
  }
  if (server.allow.empty() && !server.on_loopback()) {
    return Error{
        "the port is not lent, because any machine that reaches " + server.Address() +
        " could write to the devices of the line; name the permitted clients with --allow ADDRESS"};
  }
  return server;
}

std::optional<std::string> InUse(const config::Line& line, const bus::LineStatus& status,
                                 bool by_tcp) {
  const std::string end = "; 'baudgate release " + line.name + " --end' takes it back";
  for (const bus::PortService& service : status.services) {
    if (service.visit && service.visit->why.empty()) {
      return "client " + service.visit->client + " uses the port of line '" + line.name + "' at " +
             service.place + end;
    }
  }
  const bool released = status.port == bus::LineStatus::Port::released && !status.lent_to_client;
  if (!by_tcp || !released) return std::nullopt;
  return "the port of line '" + line.name + "' is lent to another program until " +
         FormatWallTime(status.released_until) + end;
}

Result<status::Target> TargetOf(const Gateway& gateway, const Request& request) {
  return status::FindTarget(*gateway.config, TextOf(request.json, "target"));
}

Result<status::Target> LineOf(const Gateway& gateway, const Request& request) {
  const auto target = TargetOf(gateway, request);
  if (!target || !target->device) return target;
  const std::string& line = gateway.config->lines[target->line].name;
  return Error{Quoted(TextOf(request.json, "target")) +
               " is a device, and this command needs a whole line: write " + line};
}

Result<status::Target> DeviceOf(const Gateway& gateway, const Request& request) {
  const auto target = TargetOf(gateway, request);
  if (!target || target->device) return target;
  return Error{"name one device: " + gateway.config->lines[target->line].name + ".DEVICE"};
}

Reply SetInUse(const Gateway& gateway, const Request& request, bool in_use) {
  const auto target = DeviceOf(gateway, request);
  if (!target) return Refused(kUnknown, target.error());
  const auto device = gateway.store.device(*target->device);
  if (!device) return Refused(kUnknown, "a reload has removed this device");
  gateway.control.SetInUse(*target->device, in_use, request.client.name);
  status::Json done = Done(gateway.config->lines[target->line]);
  done["device"] = device->name;
  done["in_use"] = in_use;
  done["enabled"] = device->enabled;
  return {OneLine(done)};
}

Reply TraceOf(const Gateway& gateway, const Request& request, bool recorded) {
  const auto target = LineOf(gateway, request);
  if (!target) return Refused(kUnknown, target.error());
  TraceWish wish{target->line, TextOf(request.json, "device")};
  if (!wish.device.empty()) {
    const auto device = status::FindDevice(*gateway.config, target->line, wish.device);
    if (!device) return Refused(kUnknown, device.error());
  }
  status::Json done = Done(gateway.config->lines[target->line]);
  done["head"] = records::TraceHead(gateway.config->lines[target->line]);
  if (!recorded) return {OneLine(done), wish};
  status::Json& records = done["records"] = status::Json::array();
  for (const records::TraceRecord& record : gateway.control.Recorded(target->line)) {
    if (Wanted(wish, record)) records.push_back(ToText(record));
  }
  return {OneLine(done)};
}

Reply ShowStatus(const Gateway& gateway, const Request& request) {
  std::optional<status::Target> target;
  if (request.json.contains("target")) {
    const auto found = TargetOf(gateway, request);
    if (!found) return Refused(kUnknown, found.error());
    target = *found;
  }
  return {OneLine(StatusJson(*gateway.config, gateway.store, gateway.info, target, request.now))};
}

Reply ShowSettings(const Gateway& gateway, const Request& request) {
  const auto target = DeviceOf(gateway, request);
  if (!target) return Refused(kUnknown, target.error());
  const auto settings = SettingsJson(*gateway.config, gateway.store, *target, request.now);
  if (!settings) return Refused(kUnknown, settings.error());
  return {OneLine(*settings)};
}

Reply Enable(const Gateway& gateway, const Request& request) {
  return SetInUse(gateway, request, true);
}

Reply Disable(const Gateway& gateway, const Request& request) {
  return SetInUse(gateway, request, false);
}

Reply ShowRecorded(const Gateway& gateway, const Request& request) {
  return TraceOf(gateway, request, true);
}

Reply Release(const Gateway& gateway, const Request& request) {
  const auto target = LineOf(gateway, request);
  if (!target) return Refused(kUnknown, target.error());
  const auto found = request.json.find("for_ms");
  const bool whole = found != request.json.end() && found->is_number_unsigned();
  const auto most = static_cast<std::uint64_t>(kMostRelease / 1ms);
  const std::uint64_t wanted = whole ? found->get<std::uint64_t>() : 0;
  if (wanted < 1000 || wanted > most) {
    return Refused(kUsage, "a port can be lent for 1s to 24h");
  }
  const Duration time = std::chrono::milliseconds(wanted);
  const config::Line& line = gateway.config->lines[target->line];
  status::Json done = Done(line);
  const bool by_tcp = request.json.contains("tcp");
  if (const auto in_use = InUse(line, gateway.store.ReadLine(target->line), by_tcp)) {
    return Refused(kUsage, *in_use);
  }
  if (by_tcp) {
    const auto server = OfferedAt(request.json, line);
    if (!server) return Refused(kUsage, server.error());
    gateway.control.Offer(target->line, *server, time);
    done["at"] = server->Address();
  } else {
    gateway.control.Release(target->line, time);
  }
  done["port"] = line.port;
  done["until"] = FormatWallTime(request.now.wall + time);
  return {OneLine(done)};
}

Reply TakeBack(const Gateway& gateway, const Request& request) {
  const auto target = LineOf(gateway, request);
  if (!target) return Refused(kUnknown, target.error());
  status::Json done = Done(gateway.config->lines[target->line]);
  const bus::LineStatus status = gateway.store.ReadLine(target->line);
  done["was_released"] = status.port == bus::LineStatus::Port::released ||
                         std::ranges::any_of(status.services, [](const bus::PortService& service) {
                           return service.open_until != WallTime{};
                         });
  gateway.control.TakeBack(target->line);
  return {OneLine(done)};
}

Reply Trace(const Gateway& gateway, const Request& request) {
  return TraceOf(gateway, request, false);
}

constexpr std::string_view kNoFile =
    "this gateway was started without a configuration file, so it cannot reload";
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
    return Refused(kUsage, "the time for the confirmation can be 1s to 24h");
  }
  ask.confirm = std::chrono::milliseconds(confirm_ms);
  ask.by = request.client.name;
  gateway.reload->Reload(ask, Answer(request));
  return {};
}

ReloadAsk TrialOf(const Request& request) {
  ReloadAsk ask;
  ask.by = request.client.name;
  ask.applied = TextOf(request.json, "applied");
  return ask;
}

Reply Confirm(const Gateway& gateway, const Request& request) {
  if (gateway.reload == nullptr) return Refused(kUnavailable, kNoFile);
  gateway.reload->Confirm(TrialOf(request), Answer(request));
  return {};
}

Reply Revert(const Gateway& gateway, const Request& request) {
  if (gateway.reload == nullptr) return Refused(kUnavailable, kNoFile);
  gateway.reload->Revert(TrialOf(request), Answer(request));
  return {};
}

Reply Asked(const Status& status) { return status ? Reply{} : Refused(kUnknown, status.error()); }

Reply Read(const Gateway& gateway, const Request& request) {
  return Asked(gateway.points.Read(*gateway.config, request.json, request.client, request.now,
                                   request.later));
}

/// Refuses a write: the point does not exist, or the value is none of its type.
Reply NoWrite(const Gateway& gateway, const Request& request, const std::string& why) {
  const bool known = status::FindPoint(*gateway.config, TextOf(request.json, "target")).ok();
  return Refused(known ? kUsage : kUnknown, why);
}

Reply Write(const Gateway& gateway, const Request& request) {
  const Status status = gateway.points.Write(*gateway.config, request.json, request.client,
                                             request.now.instant, request.later);
  return status ? Reply{} : NoWrite(gateway, request, status.error());
}

Reply MayWrite(const Gateway& gateway, const Request& request) {
  const auto answer = gateway.points.MayWrite(*gateway.config, request.json, request.now.instant);
  return answer ? Reply{OneLine(*answer)} : NoWrite(gateway, request, answer.error());
}

Reply Ask(const Gateway& gateway, const Request& request) {
  return Asked(AskManually(*gateway.config, gateway.control, gateway.sink, request.json,
                           request.client, request.now.instant, request.later));
}

}  // namespace

std::string RecordLine(const records::TraceRecord& record) {
  return OneLine({{"record", ToText(record)}});
}

bool Wanted(const TraceWish& wish, const records::TraceRecord& record) {
  return wish.device.empty() || record.device.empty() || record.device == wish.device;
}

const std::vector<Command>& Commands() {
  using enum Member::Type;
  using enum Act;
  static const std::vector<Command> commands = {
      {"status", read, {{"target"}}, ShowStatus},
      {"read", read, {{"target"}}, Read},
      {"write",
       operate,
       {{"target"}, {"value"}, {"confirm", flag}, {"client"}, {"seq", whole}, {"expect"}},
       Write},
      {"may_write", read, {{"target"}, {"value"}}, MayWrite},
      {"ask", configure, {{"target"}, {"telegram"}, {"write", flag}}, Ask},
      {"writes", audit, {{"after", whole}, {"since_ms", whole}, {"order"}}, ShowWrites, true},
      {"events",
       read,
       {{"after", whole},
        {"since_ms", whole},
        {"until_ms", whole},
        {"target"},
        {"kind"},
        {"priority"},
        {"text"}},
       ShowEvents,
       true},
      {"alarms", read, {{"after", whole}}, ShowAlarms},
      {"history",
       read,
       {{"point"},
        {"after", two_wholes},
        {"since_ms", whole},
        {"until_ms", whole},
        {"every_ms", whole}},
       ShowHistory,
       true},
      {"kept_points", read, {{"pattern"}}, ShowKeptPoints},
      {"ack", operate, {{"target"}, {"line"}, {"seq", wholes}}, Acknowledge},
      {"settings", read, {{"target"}}, ShowSettings},
      {"release",
       operate,
       {{"target"}, {"for_ms", whole}, {"tcp"}, {"rfc2217", flag}, {"allow"}},
       Release},
      {"take_back", operate, {{"target"}}, TakeBack},
      {"enable", operate, {{"target"}}, Enable},
      {"disable", operate, {{"target"}}, Disable},
      {"trace", read, {{"target"}, {"device"}}, Trace},
      {"recorded", read, {{"target"}, {"device"}}, ShowRecorded},
      {"reload", configure, {{"dry_run", flag}, {"confirm_ms", whole}}, Reload},
      {"confirm", configure, {{"applied"}}, Confirm},
      {"revert", configure, {{"applied"}}, Revert},
  };
  return commands;
}

namespace {

using Type = Member::Type;

bool IsWhole(const status::Json& value) {
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (value.is_number_unsigned()) return value.get<std::uint64_t>() <= kMost;
  return value.is_number_integer();
}

bool Is(Type type, const status::Json& value) {
  switch (type) {
    case Type::text:
      return value.is_string();
    case Type::flag:
      return value.is_boolean();
    case Type::whole:
      return IsWhole(value);
    case Type::two_wholes:
    case Type::wholes:
      break;
  }
  const bool fits = type == Type::wholes || value.size() == 2;
  return value.is_array() && fits && std::all_of(value.begin(), value.end(), IsWhole);
}

std::string_view Words(Type type) {
  constexpr std::array<std::string_view, 5> kWords = {"a text in quotation marks", "true or false",
                                                      "a whole number", "two whole numbers in [ ]",
                                                      "a list of whole numbers in [ ]"};
  return kWords[static_cast<std::size_t>(type)];
}

std::string Shown(const status::Json& value) {
  constexpr std::size_t kMost = 40;
  std::string text = value.dump(-1, ' ', true, status::Json::error_handler_t::replace);
  if (text.size() > kMost) text = text.substr(0, kMost) + "…";
  return text;
}

/// Checks that a request has only members of its command, with their types. A misspelt member is
/// refused, because the client would not notice that it is ignored.
///
///   {"command":"reload","dry_run":"yes"}   'dry_run' of 'reload' must be true or false, not "yes"
///   {"command":"release","for":"10m"}      'for' is not a member of 'release'; …
Status CheckShape(const Command& command, const status::Json& request) {
  std::vector<std::string_view> names;
  for (const Member& member : command.members) names.push_back(member.name);
  for (const auto& [name, value] : request.items()) {
    if (name == "command") continue;
    const auto member = std::ranges::find(command.members, name, &Member::name);
    if (member == command.members.end()) {
      return Error{Quoted(name) + " is not a member of " + Quoted(command.name) + ";" +
                   DidYouMean(name, names) + " members: " + Join(names)};
    }
    if (Is(member->type, value)) continue;
    return Error{Quoted(name) + " of " + Quoted(command.name) + " must be " +
                 std::string(Words(member->type)) + ", not " + Shown(value)};
  }
  return {};
}

constexpr std::string_view kLate =
    "the disk of the records does not answer in time; look at the disk (dmesg)";

}  // namespace

RecordReader::RecordReader() : worker_("records", [this](bool last) { return Round(last); }) {
  worker_.Start();
}

Reply RecordReader::Ask(const Command& command, std::shared_ptr<const Gateway> gateway,
                        status::Json request, bus::Writer client, Now now,
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

/// A command that is not listed for people, because only the command line tool uses it.
constexpr std::string_view kNotListed = "kept_points";

std::string NoCommand(const std::string& name) {
  std::vector<std::string_view> names;
  for (const Command& command : Commands()) {
    if (command.name != kNotListed) names.push_back(command.name);
  }
  return Quoted(name) + " is not a command;" + DidYouMean(name, names) +
         " commands: " + Join(names);
}

/// True for commands that the security journal records: those that change something. The audit has
/// the records of writes.
bool IsRecorded(const Command& command) {
  return command.name != "write" && (command.act == Act::operate || command.act == Act::configure);
}

/// Returns the command with its target and options, without the telegram of `ask`, which can
/// contain a password: "release bay-1 tcp 127.0.0.1:4001".
std::string WhatOf(const Command& command, const status::Json& request) {
  std::string what(command.name);
  for (const Member& member : command.members) {
    const auto given = request.find(member.name);
    if (given == request.end() || member.name == "telegram") continue;
    if (member.name != "target") what += " " + std::string(member.name);
    what += " " + (given->is_string() ? given->get<std::string>() : given->dump());
  }
  return what;
}

/// Returns "ok", or the reason of a failure, or what a reload has changed.
std::string ResultOf(const status::Json& answer) {
  if (!answer.is_object()) return "ok";
  if (answer.contains("error")) return answer.value("message", std::string("failed"));
  if (!answer.value("ok", true)) return answer.value("text", std::string("failed"));
  std::string result = "ok";
  if (const auto changes = answer.find("changes"); changes != answer.end()) {
    for (const auto& change : *changes) result += "; " + change.get<std::string>();
  }
  return result;
}
const std::string& WhoIs(const bus::Writer& client) {
  return client.from.empty() ? client.name : client.user;
}

std::string DenialText(const bus::Writer& client, const Command& command) {
  return client.name + " has the role " + std::string(Name(*client.role)) + ", and '" +
         std::string(command.name) + "' needs the role " +
         std::string(Name(NeededFor(command.act)));
}

}  // namespace

RequestHandler::RequestHandler(const config::Config& config, const bus::PointStore& store,
                               lines::LineControl& control, bus::CommandSink& sink,
                               status::GatewayInfo info)
    : points_(store, sink, [audit = info.audit] { return audit::PastOf(audit); }),
      gateway_(std::make_shared<Gateway>(Gateway{
          {std::shared_ptr<void>(), &config}, store, control, sink, std::move(info), points_})) {}

Reply RequestHandler::Answer(std::string_view request, const bus::Writer& client, Now now,
                             const Later& later) {
  const status::Json json = status::Json::parse(request, nullptr, false);
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
  if (client.role && !May(*client.role, command->act)) {
    const std::string why = DenialText(client, *command);
    if (present->info.journal != nullptr) {
      present->info.journal->Note(
          {"denied", WhoIs(client), client.from, WhatOf(*command, json), why}, now.wall);
    }
    return Refused(kDenied, why + "; an administrator changes roles with: baudgate users add");
  }
  if (command->reads_disk && reader_) {
    return reader_->Ask(*command, present, json, client, now, later);
  }
  std::function<void(const status::Json&)> note = [](const status::Json&) {};
  if (present->info.journal != nullptr && IsRecorded(*command)) {
    note = [journal = present->info.journal, who = WhoIs(client), from = client.from,
            what = WhatOf(*command, json)](const status::Json& answer) {
      journal->Note({"command", who, from, what, ResultOf(answer)}, ReadClocks().wall);
    };
  }
  Reply reply = command->answer(*present, {json, client, now, [later, note](const auto& answer) {
                                             note(answer);
                                             later(OneLine(answer));
                                           }});
  if (!reply.text.empty()) note(status::Json::parse(reply.text, nullptr, false));
  return reply;
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
