// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/telegram_requests.h"

#include <memory>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/outputs/control/request_text.h"
#include "gateway/outputs/status/target.h"
#include "gateway/records/trace/trace_head.h"
#include "protocols/masked_hex.h"
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

}  // namespace baudgate::control
