// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/decode.h"

#include "gateway/base/text.h"
#include "protocols/spabus/events.h"
#include "protocols/spabus/nack.h"
#include "protocols/spabus/settings.h"
#include "protocols/spabus/values.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr const char* kOtherForm = "does the profile fit the device, item by item?";
constexpr const char* kFewer = "set max_items: 1 in the configuration; does the profile fit it?";

/// In place of a checksum, by `send_xx`.
constexpr std::string_view kUnchecked = "XX\r";

Answer Unexpected(std::string reason, const char* remedy = kOtherForm) {
  Answer answer;
  answer.remedy = remedy;
  answer.outcome = Outcome::unexpected;
  answer.reason = std::move(reason);
  return answer;
}

/// The items of a command in the order of their values: all numbers of the first channel, then the
/// next channel. For one channel this is certain, for several it is inferred.
std::vector<Address> ItemsOf(const Command& command) {
  std::vector<Address> items;
  for (unsigned channel = command.channels.first; channel <= command.channels.last; ++channel) {
    if (!command.numbers) {
      items.push_back({channel, command.category, std::nullopt});
      continue;
    }
    for (std::uint32_t n = command.numbers->first; n <= command.numbers->last; ++n) {
      items.push_back({channel, command.category, n});
    }
  }
  return items;
}

bool HidesPassword(const Address& item) {
  return item.category == 'V' && item.number && *item.number >= kPasswordItems.first &&
         *item.number <= kPasswordItems.last;
}

void AddValue(const Address& item, std::string_view text, std::span<const ReadPoint> points,
              Answer& answer) {
  bool known = false;
  for (const ReadPoint& candidate : points) {
    if (candidate.address != item || candidate.offset) continue;
    known = true;
    const Decoded decoded = DecodeValue(text, *candidate.point);
    answer.readings.push_back({candidate.index, decoded.value, decoded.quality, {}});
    if (!IsGood(decoded.quality)) answer.no_number = std::string(Trim(text));
  }
  if (!known)
    answer.readings.push_back({kNoPoint, GuessValue(text), Quality::good, FormatAddress(item)});
}

/// Lists of events and alarms have as many parts as there are; each is passed on as text.
Answer DecodeList(const Command& command, const Reply& reply) {
  Answer answer;
  const Address item{command.channels.first, command.category, std::nullopt};
  if (reply.data.empty()) return answer;
  for (const std::string_view part : Split(reply.data, '/')) {
    answer.readings.push_back(
        {kNoPoint, Value(std::string(Trim(part))), Quality::good, FormatAddress(item)});
  }
  return answer;
}

Answer DecodeData(const Command& command, const Reply& reply, std::span<const ReadPoint> points) {
  if (IsEventList(command.category)) return DecodeList(command, reply);
  // An alarm is text for people, and a slash in it separates nothing.
  const auto texts =
      command.category == 'A' ? std::vector<std::string_view>{reply.data} : Split(reply.data, '/');
  // A range that only a capture could ask for must not make us build a list without end.
  if (texts.size() != command.ItemCount()) {
    return Unexpected("the reply has " + std::to_string(texts.size()) + " values where " +
                          std::to_string(command.ItemCount()) + " were asked for",
                      texts.size() < command.ItemCount() ? kFewer : kOtherForm);
  }
  const std::vector<Address> items = ItemsOf(command);
  Answer answer;
  for (std::size_t i = 0; i < items.size(); ++i) {
    AddValue(items[i], texts[i], points, answer);
  }
  return answer;
}

Answer DecodeNack(const Command& command, int code, std::span<const ReadPoint> points) {
  const NackRule& rule = RuleOf(code);
  Answer answer;
  answer.outcome = rule.outcome;
  answer.wait = rule.wait;
  answer.reason = Explain(code);
  answer.remedy = rule.remedy;
  if (rule.missing && !command.write && command.ItemCount() == 1) {
    const Address item = ItemsOf(command).front();
    for (const ReadPoint& candidate : points) {
      if (candidate.address != item) continue;
      answer.readings.push_back(
          {candidate.index, {}, {Quality::bad_configuration, Reason::not_fitted}, {}});
    }
  }
  return answer;
}

}  // namespace

std::vector<Reading> WrittenBy(const Command& command) {
  const auto texts = Split(command.data, '/');
  std::vector<Reading> readings;
  // One text for several items, or several for one: which is whose is not known.
  if (texts.size() != command.ItemCount()) return readings;
  const std::vector<Address> items = ItemsOf(command);
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (HidesPassword(items[i])) continue;
    readings.push_back(
        {kNoPoint, GuessValue(texts[i]), Quality::good, FormatAddress(items[i]) + " written"});
  }
  return readings;
}

Exchange Decode(View request, View frame, std::span<const ReadPoint> points) {
  Exchange exchange;
  exchange.command = ParseRequest(request).command;
  if (!exchange.command) {
    exchange.answer = Unexpected("the request is no SPA message");
    return exchange;
  }
  const Command& command = *exchange.command;
  const auto reply = ParseReply(frame);
  if (!reply) {
    exchange.answer = Unexpected("the reply is no SPA message");
  } else if (reply->slave != command.slave) {
    exchange.answer = Unexpected("slave " + std::to_string(reply->slave) +
                                 " answered in place of " + std::to_string(command.slave));
  } else if (reply->type == 'N') {
    exchange.nack = reply->nack;
    exchange.answer = reply->nack ? DecodeNack(command, *reply->nack, points)
                                  : Unexpected("a NACK without a code");
    if (reply->nack == 0 && AsText(request).ends_with(kUnchecked)) {
      exchange.answer.remedy = "it may want a checksum: set send_xx: false in the configuration";
    }
  } else if ((reply->type == 'A') != command.write) {
    exchange.answer = Unexpected(command.write ? "data came in answer to a write"
                                               : "an acknowledge came in answer to a read");
  } else if (!command.write) {
    exchange.answer = DecodeData(command, *reply, points);
    exchange.data = reply->data;
  }
  return exchange;
}

}  // namespace baudgate::protocols::spabus
