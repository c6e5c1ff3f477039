// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/scan/ask.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <sstream>

#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/records/trace/trace_text.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/offline/decode.h"
#include "gateway/tools/cli/offline/make_line.h"
#include "gateway/tools/cli/scan/target.h"
#include "gateway/tools/terminal/command_end.h"
#include "protocols/frame_rule.h"

namespace baudgate::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kSilent = 1;

struct Exchanged {
  std::string sent{};      ///< the request in hex, secrets masked; empty: nothing was sent
  std::string received{};  ///< the reply in hex
  std::string reason{};
  records::TracedDevice device{};
};

int Fail(std::ostream& err, int code, const std::string& why) {
  err << "baudgate: ask: " << why << '\n';
  return code;
}

/// Returns the bytes of a telegram. Hex is parsed; other text must begin with punctuation, as text
/// telegrams of all protocols do, and is sent unchanged.
Result<Bytes> WrittenOf(const std::string& telegram) {
  if (const auto bytes = ParseHex(telegram)) return *bytes;
  const bool mark = !telegram.empty() && std::ispunct(static_cast<unsigned char>(telegram[0])) != 0;
  if (mark) return ToBytes(telegram);
  return Error{"'" + telegram +
               "' is neither hex, two digits for each byte as in '01 03 00 00 00 01', nor a "
               "telegram in text, as in '>1RV201:XX'"};
}

/// Returns the first installed protocol whose telegrams begin with the same character as
/// `telegram`; empty: there is no such protocol.
std::string ProtocolLike(const std::string& telegram, const config::Catalog& catalog) {
  for (const auto& [name, protocol] : catalog.protocols) {
    const bool begins = protocol->telegram != nullptr && !telegram.empty() &&
                        protocol->telegram->leads.find(telegram[0]) != std::string_view::npos;
    if (begins) return name;
  }
  return {};
}

std::string TextOf(const std::string& hex) {
  const auto bytes = ParseHex(hex);
  if (!bytes) return {};
  const auto printable = std::ranges::count_if(*bytes, [](auto byte) {
    return (byte >= 0x20 && byte < 0x7F) || byte == '\r' || byte == '\n';
  });
  const bool text = static_cast<std::size_t>(printable) == bytes->size();
  return text && !bytes->empty() ? "   " + Printable(*bytes) : std::string();
}

int Show(const AskOptions& options, const Exchanged& exchange, const config::Catalog& catalog,
         std::ostream& out) {
  DecodeOptions how{.protocol = exchange.device.protocol,
                    .profile = options.profile.empty() ? exchange.device.profile : options.profile,
                    .set = exchange.device.set,
                    .width = options.width};
  how.prose = !options.json;
  std::istringstream captured("> " + exchange.sent + "\n" +
                              (exchange.received.empty() ? "" : "< " + exchange.received + "\n"));
  std::ostringstream decoded;
  std::ostringstream ignored;  // the bytes are shown even if they cannot be decoded
  if (RunDecode(how, catalog, captured, decoded, ignored) != kExitDone && !how.profile.empty()) {
    // If the profile is a file on the gateway's machine, the bytes are decoded without a profile.
    how.profile.clear();
    captured.clear();
    captured.seekg(0);
    decoded.str({});
    RunDecode(how, catalog, captured, decoded, ignored);
  }
  if (options.json) {
    Json json = {{"sent", exchange.sent}, {"received", exchange.received}};
    const Json meaning = Json::parse(decoded.str(), nullptr, false);
    if (meaning.is_object()) json.update(meaning);
    if (!exchange.reason.empty()) json["reason"] = exchange.reason;
    out << json.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
  } else {
    out << "> " << exchange.sent << TextOf(exchange.sent) << '\n';
    if (!exchange.received.empty()) {
      out << "< " << exchange.received << TextOf(exchange.received) << '\n';
    }
    out << decoded.str();
    if (!exchange.reason.empty()) out << exchange.reason << '\n';
  }
  return exchange.received.empty() ? kSilent : kExitDone;
}

int AskOnPort(const AskOptions& options, const config::Catalog& catalog, std::ostream& out,
              std::ostream& err) {
  const std::string name =
      options.protocol.empty() ? ProtocolLike(options.telegram, catalog) : options.protocol;
  if (name.empty()) {
    return Fail(err, kExitUsage,
                "add --protocol, because the beginning of the telegram does not show the protocol");
  }
  const protocols::Protocol* known = catalog.FindProtocol(name);
  if (known != nullptr && known->telegram == nullptr) {
    return Fail(err, kExitUsage, "this command cannot send telegrams of protocol " + name);
  }
  if (known != nullptr && known->describe != nullptr && options.profile.empty()) {
    return Fail(err, kExitUsage,
                "add --profile, because only a profile defines the telegrams, and which telegrams "
                "only read");
  }
  const auto line =
      MakeLine({.port = options.target,
                .protocol = name,
                .serial = options.serial,
                .devices = {{.profile = options.profile, .address = "1", .set = options.set}}},
               catalog);
  if (!line) return Fail(err, kExitUsage, line.error());
  const protocols::Protocol& protocol = *catalog.FindProtocol(name);
  const protocols::ParsedOptions its = ParseOptions(protocol, line->devices.front().options);
  const auto bytes = WrittenOf(options.telegram);
  if (!bytes) return Fail(err, kExitUsage, bytes.error());
  const auto telegram = protocol.telegram->complete(*bytes, its);
  if (!telegram) return Fail(err, kExitUsage, telegram.error());
  if (!protocol.telegram->is_read(*telegram, its) && !options.write) {
    return Fail(err, kExitUsage,
                "not sent, because this telegram may write (" +
                    MaskedHex(*telegram, protocol.expect(*telegram, its)) +
                    "); add --write to send it");
  }
  const StopSignals stop;
  config::SerialSettings serial = line->serial;
  serial.rs485.enabled = options.rs485;
  auto wire = PortWire::Open(options.target, serial, stop);
  if (!wire) return Fail(err, kExitCanNot, wire.error());
  const config::Timing timing = protocol.timing(line->serial);
  const auto gathered = (*wire)->Ask(*telegram, *timing.reply, *timing.gap);
  if (!gathered) return Fail(err, kExitCanNot, gathered.error());
  Exchanged exchange;
  exchange.sent = MaskedHex(*telegram, protocol.expect(*telegram, its));
  exchange.received = ToHex(gathered->heard);
  exchange.device = {.protocol = name, .profile = options.profile, .set = options.set};
  return Show(options, exchange, catalog, out);
}

/// Returns the first given option that is only for a free port, such as "--serial"; empty: there is
/// no such option.
std::string OptionOfPort(const AskOptions& options) {
  if (!options.protocol.empty()) return "--protocol";
  if (!options.serial.empty()) return "--serial";
  if (!options.set.empty()) return "--checksum or --set";
  return options.rs485 ? "--rs485" : "";
}

int AskGateway(const AskOptions& options, const config::Catalog& catalog, std::ostream& out,
               std::ostream& err) {
  const auto bytes = WrittenOf(options.telegram);
  if (!bytes) return Fail(err, kExitUsage, bytes.error());
  Json answer;
  const Json request = {{"command", "ask"},
                        {"target", options.target},
                        {"telegram", ToHex(*bytes)},
                        {"write", options.write}};
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  Exchanged exchange;
  exchange.sent = answer.value("sent", "");
  exchange.received = answer.value("received", "");
  exchange.reason = answer.value("reason", "");
  exchange.device.protocol = answer.value("protocol", "");
  for (const Json& line : answer.value("head", Json::array())) {
    const auto device =
        line.is_string() ? records::ReadTracedDevice(line.get<std::string>()) : std::nullopt;
    if (device && device->name == answer.value("device", "")) exchange.device = *device;
  }
  if (!exchange.sent.empty()) return Show(options, exchange, catalog, out);
  if (options.json) {
    out << Json{{"sent", ""}, {"received", ""}, {"reason", exchange.reason}}.dump(
               -1, ' ', false, Json::error_handler_t::replace)
        << '\n';
  }
  return Fail(err, kExitCanNot, "nothing was sent: " + exchange.reason);
}

}  // namespace

int RunAsk(const AskOptions& options, const config::Catalog& catalog, std::ostream& out,
           std::ostream& err) {
  if (const Status target = CheckTarget(options.target); !target) {
    return Fail(err, kExitUsage, target.error());
  }
  if (IsPort(options.target)) return AskOnPort(options, catalog, out, err);
  const std::string refused = OptionOfPort(options);
  if (!refused.empty()) {
    return Fail(err, kExitUsage,
                refused + " is only for a free port; remove it, because the settings of line " +
                    options.target + " are in the configuration of the gateway");
  }
  return AskGateway(options, catalog, out, err);
}

}  // namespace baudgate::tools
