// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/line_requests.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/outputs/status/target.h"
#include "gateway/records/trace/trace_text.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"

namespace baudgate::control {

namespace {

/// How long the line has for it.
constexpr Duration kHandPatience = 8s;

struct Addressed {
  const config::Line* line = nullptr;
  const config::Device* device = nullptr;
  std::uint32_t index = 0;  ///< of the device, in the point store
};

/// A line stands for the first of its devices that speaks its protocol.
Result<Addressed> AddressOf(const config::Config& config, const Json& request) {
  const auto target = FindTarget(config, TextOf(request, "target"));
  if (!target) return Error{target.error()};
  const config::Line& line = config.lines[target->line];
  for (const config::Device& device : line.devices) {
    const auto found = FindDevice(config, target->line, device.name);
    if (!found || !found->device) continue;
    const bool wanted =
        target->device ? *target->device == *found->device : device.protocol == line.protocol;
    if (wanted) return Addressed{&line, &device, *found->device};
  }
  return Error{"line '" + line.name +
               "' has no device that speaks its protocol; add one, or release the line and ask on "
               "its port"};
}

Status Allows(const Addressed& to, bool reads, bool confirmed) {
  if (reads) return {};
  const std::string telegram = "nothing proves that this telegram only reads: ";
  if (to.line->ask != config::Ask::write) {
    return Error{telegram + "line '" + to.line->name +
                 "' lets it pass only where it says 'ask: write'"};
  }
  if (!confirmed) return Error{telegram + "say --write if you mean it"};
  return {};
}

}  // namespace

Status AskManually(const config::Config& config, LineControl& control, CommandSink& sink,
                   const Json& request, const Writer& writer, Instant now,
                   const std::function<void(const Json&)>& answered) {
  const auto to = AddressOf(config, request);
  if (!to) return Error{to.error()};
  const Protocol* protocol = control.FindProtocol(to->device->protocol);
  if (protocol == nullptr || protocol->telegram == nullptr ||
      SpeaksUnasked(*protocol, to->device->options)) {
    return Error{"telegrams by hand are not supported for " + to->device->protocol};
  }
  const auto written = ParseHex(TextOf(request, "telegram"));
  if (!written || written->empty()) return Error{"'telegram' is bytes in hex: 3E 31 52 46 3A"};
  const ParsedOptions options = ParseOptions(*protocol, to->device->options);
  const auto bytes = protocol->telegram->complete(*written, options);
  if (!bytes) return Error{bytes.error()};
  const auto flag = request.find("write");
  const bool confirmed = flag != request.end() && flag->is_boolean() && flag->get<bool>();
  auto telegram = std::make_shared<Telegram>();
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
  WriteCommand command;
  command.device = to->index;
  command.client = writer.name;
  command.kind = telegram;
  command.deadline = now + kHandPatience;
  command.abandoned = writer.left;
  const Json head = {{"protocol", protocol->name},
                     {"sent", telegram->shown},
                     {"write", !telegram->reads},
                     {"device", to->device->name},
                     {"head", TraceHead(*to->line)}};
  command.done = [answered, telegram, head](const WriteResult& result) {
    Json json = head;
    // On a line that is lent, for example.
    if (result.end == WriteEnd::not_sent || result.end == WriteEnd::denied) json["sent"] = "";
    json["received"] = ToHex(telegram->reply);
    json["outcome"] = telegram->outcome.empty() ? std::string(Name(result.end)) : telegram->outcome;
    json["reason"] = result.reason;
    answered(json);
  };
  if (!sink.Submit(std::move(command))) return Error{"too many commands wait for the line"};
  return {};
}

namespace {

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

/// Nothing if the port is free; otherwise a sentence that says who has it.
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

Result<Target> TargetOf(const Gateway& gateway, const Request& request) {
  return FindTarget(*gateway.config, TextOf(request.json, "target"));
}

Result<Target> LineOf(const Gateway& gateway, const Request& request) {
  const auto target = TargetOf(gateway, request);
  if (!target || !target->device) return target;
  const std::string& line = gateway.config->lines[target->line].name;
  return Error{config::Quoted(TextOf(request.json, "target")) +
               " is one device; this is done with a line as a whole: write " + line};
}

Result<Target> DeviceOf(const Gateway& gateway, const Request& request) {
  const auto target = TargetOf(gateway, request);
  if (!target || target->device) return target;
  return Error{"name one device: " + gateway.config->lines[target->line].name + ".DEVICE"};
}

Reply SetInUse(const Gateway& gateway, const Request& request, bool in_use) {
  const auto target = DeviceOf(gateway, request);
  if (!target) return Refused(kUnknown, target.error());
  gateway.control.SetInUse(*target->device, in_use);
  Json done = Done(gateway.config->lines[target->line]);
  done["device"] = gateway.store.device(*target->device).name;
  done["in_use"] = in_use;
  done["enabled"] = gateway.store.device(*target->device).enabled;
  return {OneLine(done)};
}

Reply TraceOf(const Gateway& gateway, const Request& request, bool recorded) {
  const auto target = LineOf(gateway, request);
  if (!target) return Refused(kUnknown, target.error());
  TraceWish wish{target->line, TextOf(request.json, "device")};
  if (!wish.device.empty()) {
    const auto device = FindDevice(*gateway.config, target->line, wish.device);
    if (!device) return Refused(kUnknown, device.error());
  }
  Json done = Done(gateway.config->lines[target->line]);
  done["head"] = TraceHead(gateway.config->lines[target->line]);
  if (!recorded) return {OneLine(done), wish};
  Json& records = done["records"] = Json::array();
  for (const TraceRecord& record : gateway.control.Recorded(target->line)) {
    if (Wanted(wish, record)) records.push_back(ToText(record));
  }
  return {OneLine(done)};
}

}  // namespace

std::string RecordLine(const TraceRecord& record) { return OneLine({{"record", ToText(record)}}); }

bool Wanted(const TraceWish& wish, const TraceRecord& record) {
  return wish.device.empty() || record.device.empty() || record.device == wish.device;
}

Reply ShowStatus(const Gateway& gateway, const Request& request) {
  std::optional<Target> target;
  if (request.json.contains("target")) {
    const auto found = TargetOf(gateway, request);
    if (!found) return Refused(kUnknown, found.error());
    target = *found;
  }
  return {OneLine(StatusJson(*gateway.config, gateway.store, gateway.info, target, request.now))};
}

Reply Release(const Gateway& gateway, const Request& request) {
  const auto target = LineOf(gateway, request);
  if (!target) return Refused(kUnknown, target.error());
  const auto found = request.json.find("for_ms");
  const bool whole = found != request.json.end() && found->is_number_unsigned();
  const auto most = static_cast<std::uint64_t>(kMostRelease / 1ms);
  const std::uint64_t wanted = whole ? found->get<std::uint64_t>() : 0;
  if (wanted < 1000 || wanted > most) {
    return Refused(kUsage, "a port is lent for a time from 1s to 24h");
  }
  const Duration time = std::chrono::milliseconds(wanted);
  const config::Line& line = gateway.config->lines[target->line];
  Json done = Done(line);
  const bool by_tcp = request.json.contains("tcp");
  if (const auto in_use = InUse(line, gateway.store.ReadLine(target->line), by_tcp)) {
    return Refused(kUsage, *in_use);
  }
  if (by_tcp) {
    const auto server = OfferedAt(request.json, line);
    if (!server) return Refused(kUsage, server.error());
    gateway.control.Offer(target->line, *server, time);
    done["at"] = server->Place();
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
  Json done = Done(gateway.config->lines[target->line]);
  const LineStatus status = gateway.store.ReadLine(target->line);
  done["was_released"] = status.port == LineStatus::Port::released ||
                         std::ranges::any_of(status.services, [](const PortService& service) {
                           return service.open_until != WallTime{};
                         });
  gateway.control.TakeBack(target->line);
  return {OneLine(done)};
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

Reply Trace(const Gateway& gateway, const Request& request) {
  return TraceOf(gateway, request, false);
}

Reply ShowRecorded(const Gateway& gateway, const Request& request) {
  return TraceOf(gateway, request, true);
}

}  // namespace baudgate::control
