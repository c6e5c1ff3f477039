// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/reply.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/spabus/events.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {
namespace {

// The rules for NACK 0 to 9, by code. Codes and meanings are those of Arcteq's table of SPA error
// codes; the reactions are chosen by this project (protocols/spabus/README.md).
constexpr NackRule kRules[] = {
    {Outcome::corrupt,
     "the device found a checksum or parity error in the request; check wiring, termination and "
     "bit rate",
     "requests reach the device damaged; check wiring and termination",
     {},
     false,
     false,
     false},
    {Outcome::busy, "the device is busy; the request is repeated", "", 1s, false, false, false},
    {Outcome::busy, "the input buffer of the device is full; lower max_items or the bit rate",
     "restart the device, or set a lower bit rate", 200ms, false, false, false},
    {Outcome::unsupported,
     "the request is too complicated for the device; the next requests have fewer items",
     "set max_items: 1 in the configuration",
     {},
     true,
     true},
    {Outcome::refused,
     "a gateway between this machine and the device reports an error; check that gateway",
     "check the gateway between this machine and the device"},
    {Outcome::unsupported,
     "the device has no item with this address; check category and number in the profile",
     "check whether the profile fits the device: it does not have these items; correct or remove "
     "the points",
     {},
     true,
     true},
    {Outcome::unsupported,
     "the device does not have this item; check the profile against its manual",
     "check whether the profile fits the device: it does not have these items; correct or remove "
     "the points",
     {},
     true,
     true},
    {Outcome::refused,
     "the item cannot be read or written now; it may be blocked, read-only, write-only or behind "
     "a password",
     "check whether the device is in test or local mode, or needs a password",
     {},
     true},
    {Outcome::refused, "the device does not accept the value; check its setting range",
     "check the setting range of the device"},
    {Outcome::refused, "the device reports an error that has no code of its own",
     "check the device"},
};
constexpr NackRule kUnknown{Outcome::refused, "the code is not in the SPA table of error codes",
                            "look the code up in the manual of the device"};

}  // namespace

const NackRule& RuleOf(int code) {
  if (code < 0 || code > 9) return kUnknown;
  return kRules[code];
}

std::string Explain(int code) {
  return "NACK " + std::to_string(code) + ": " + std::string(RuleOf(code).meaning);
}

namespace {

constexpr std::string_view kLineBreak = "&\r\n";

std::string_view Body(View frame) {
  std::string_view text = AsText(frame);
  if (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
  return text;
}

std::uint8_t Sum(std::string_view text, std::string_view without) {
  std::uint8_t sum = 0;
  for (const char c : text) {
    if (without.find(c) == std::string_view::npos) sum ^= static_cast<std::uint8_t>(c);
  }
  return sum;
}

/// Returns the checksum of a reply in the variant `reading`. `covered`: the text from `<` to the
/// last colon.
std::uint8_t SumOf(std::string_view covered, int reading) {
  const std::uint8_t line_feed = (reading & kLineFeedCovered) != 0 ? kLf : 0;
  switch (reading & kCoversAny) {
    case kCoversNoLineEnds:
      return Sum(covered, "\r\n") ^ line_feed;
    case kCoversCharacters:
      return Sum(covered, "&\r\n") ^ line_feed;
    case kCoversLastLine: {
      const auto last = covered.rfind('\n');
      if (last == std::string_view::npos) return Sum(covered, {}) ^ line_feed;
      return Sum(covered.substr(last + 1), {});
    }
    default:
      return Sum(covered, {}) ^ line_feed;
  }
}

/// Joins the lines without a separator, because a line break can be inside a value. Sets
/// `continued` if there are several lines. Empty: a character is not allowed.
std::optional<std::string> Join(std::string_view lines, bool& continued) {
  std::string data;
  for (;;) {
    const auto at = lines.find(kLineBreak);
    const std::string_view line = lines.substr(0, at);
    const bool clean = std::all_of(line.begin(), line.end(), [](char c) {
      return IsPrintable(static_cast<std::uint8_t>(c)) && (c == '/' || !IsReserved(c));
    });
    if (!clean) return std::nullopt;
    data += line;
    if (at == std::string_view::npos) return data;
    continued = true;
    lines.remove_prefix(at + kLineBreak.size());
  }
}

Bytes Seal(const std::string& covered, int reading) {
  Bytes frame{kLf};
  Append(frame, covered);
  Append(frame, HexByte(SumOf(covered, reading)));
  frame.push_back(kCr);
  frame.push_back(kLf);
  return frame;
}

}  // namespace

std::optional<Reply> ParseReply(View frame) {
  std::string_view rest = Body(frame);
  if (rest.empty() || rest.front() != '<') return std::nullopt;
  rest.remove_prefix(1);
  Reply reply;
  const auto slave = TakeNumber(rest, 3);
  if (!slave || rest.size() < 4) return std::nullopt;
  reply.slave = *slave;
  reply.type = rest.front();
  rest.remove_prefix(1);
  const std::string_view checksum = rest.substr(rest.size() - 2);
  if (rest[rest.size() - 3] != ':') return std::nullopt;
  reply.wildcard = checksum == kWildcard;
  if (!reply.wildcard && !(HexDigit(checksum[0]) && HexDigit(checksum[1]))) return std::nullopt;
  rest.remove_suffix(2);  // `rest` is now the text from after the type to the last colon

  if (reply.type == 'A') return rest == ":" ? std::optional(reply) : std::nullopt;
  if (reply.type == 'N') {
    // No source defines the layout of a NACK. Its first digit is assumed to be the code.
    const auto digit = rest.find_first_of("0123456789");
    if (digit != std::string_view::npos) reply.nack = rest[digit] - '0';
    if (rest.find_first_of("&\r\n") != std::string_view::npos) return std::nullopt;
    return reply;
  }
  if (reply.type != 'D' || rest.size() < 2 || rest.front() != ':') return std::nullopt;
  auto data = Join(rest.substr(1, rest.size() - 2), reply.continued);
  if (!data) return std::nullopt;
  reply.data = std::move(*data);
  return reply;
}

int MatchingReadings(View frame, bool line_feed_covered) {
  const std::string_view body = Body(frame);
  if (body.size() < 3) return 0;
  const auto received = ParseInteger<std::uint8_t>(body.substr(body.size() - 2), 16);
  if (!received) return 0;
  const std::string_view covered = body.substr(0, body.size() - 2);
  int readings = 0;
  for (int reading = kCoversAll; reading <= kCoversLastLine; reading <<= 1) {
    if (SumOf(covered, reading | (line_feed_covered ? kLineFeedCovered : 0)) == *received) {
      readings |= reading;
    }
  }
  return readings;
}

bool ChecksumPasses(View frame, int accepted) {
  if ((accepted & kWildcardAccepted) != 0 && Body(frame).ends_with(kWildcard)) return true;
  return (MatchingReadings(frame, (accepted & kLineFeedCovered) != 0) & accepted) != 0;
}

std::optional<Bytes> EncodeData(unsigned slave, std::string_view data, int reading) {
  constexpr std::size_t kTail = 3;  // size of the last colon and the checksum
  std::string text = "<" + std::to_string(slave) + "D:";
  std::size_t line = text.size();
  std::size_t lines = 1;
  while (line + data.size() + kTail > kMaxLine) {
    const std::size_t room = std::min(kMaxLine - 1 - line, data.size());
    text += data.substr(0, room);
    data.remove_prefix(room);
    text += kLineBreak;
    line = 0;
    if (++lines > kMaxLines) return std::nullopt;
  }
  text += data;
  text += ':';
  return Seal(text, reading);
}

Bytes EncodeAck(unsigned slave, int reading) {
  return Seal("<" + std::to_string(slave) + "A:", reading);
}

Bytes EncodeNack(unsigned slave, int code, int reading) {
  return Seal("<" + std::to_string(slave) + "N:" + std::to_string(code) + ":", reading);
}

namespace {

constexpr int kDoubtsBeforeForgetting = 3;

}  // namespace

void ContinuationChecksum::Confirm(int matching) {
  doubts_ = 0;
  const int narrowed = accepted_ & matching;
  if (narrowed != 0) accepted_ = narrowed;
}

void ContinuationChecksum::Doubt() {
  if (++doubts_ >= kDoubtsBeforeForgetting) Forget();
}

char ContinuationChecksum::letter() const {
  for (const auto& [reading, letter] : {std::pair(kCoversAll, 'a'),
                                        {kCoversNoLineEnds, 'b'},
                                        {kCoversCharacters, 'c'},
                                        {kCoversLastLine, 'd'}}) {
    if (accepted_ == reading) return letter;
  }
  return 0;
}

void ContinuationChecksum::Forget() {
  accepted_ = kCoversAny;
  doubts_ = 0;
}

namespace {

constexpr const char* kOtherForm = "check whether the profile fits the device, item by item";
constexpr const char* kFewer =
    "set max_items: 1 in the configuration, and check whether the profile fits the device";

/// The end of a request that is sent with `send_xx`, without a checksum.
constexpr std::string_view kUnchecked = "XX\r";

Answer Unexpected(std::string reason, const char* remedy = kOtherForm) {
  Answer answer;
  answer.remedy = remedy;
  answer.outcome = Outcome::unexpected;
  answer.reason = std::move(reason);
  return answer;
}

/// Returns the items of a command in the order of their values in the reply: all numbers of the
/// first channel, then those of the next channel. This order is certain for one channel, and
/// inferred for several.
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

std::span<const ReadPoint> PointsOf(const Address& item, std::span<const ReadPoint> points) {
  // std::ranges::equal_range is not used, because clang 14, which checks each source alone, cannot
  // compile it.
  const auto first = std::ranges::lower_bound(points, item, {}, &ReadPoint::address);
  const auto last = std::ranges::upper_bound(first, points.end(), item, {}, &ReadPoint::address);
  return {first, last};
}

void AddValue(const Address& item, std::string_view text, std::span<const ReadPoint> points,
              Answer& answer) {
  bool known = false;
  for (const ReadPoint& candidate : PointsOf(item, points)) {
    if (candidate.offset) continue;
    known = true;
    const Decoded decoded = DecodeValue(text, *candidate.point);
    answer.readings.push_back({candidate.index, decoded.value, decoded.quality, {}});
    if (!IsGood(decoded.quality)) answer.no_number = std::string(Trim(text));
  }
  if (!known)
    answer.readings.push_back({kNoPoint, GuessValue(text), Quality::good, FormatAddress(item)});
}

/// Returns each part of a list of events or alarms as a text. The number of parts is not known in
/// advance, so it is not checked.
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
  // An alarm is a text for people, so a slash in it is not a separator.
  const auto texts =
      command.category == 'A' ? std::vector<std::string_view>{reply.data} : Split(reply.data, '/');
  // The number is checked before ItemsOf is called, because a captured request can ask for a huge
  // range.
  if (texts.size() != command.ItemCount()) {
    return Unexpected("the reply has " + std::to_string(texts.size()) + " values instead of " +
                          std::to_string(command.ItemCount()),
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
    for (const ReadPoint& candidate : PointsOf(item, points)) {
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
  // If the numbers of texts and items differ, it is unknown which text belongs to which item.
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
    exchange.answer = Unexpected("the request is not an SPA message");
    return exchange;
  }
  const Command& command = *exchange.command;
  const auto reply = ParseReply(frame);
  if (!reply) {
    exchange.answer = Unexpected("the reply is not an SPA message");
  } else if (reply->slave != command.slave) {
    exchange.answer = Unexpected("slave " + std::to_string(reply->slave) + " answered instead of " +
                                 std::to_string(command.slave));
  } else if (reply->type == 'N') {
    exchange.nack = reply->nack;
    exchange.answer = reply->nack ? DecodeNack(command, *reply->nack, points)
                                  : Unexpected("a NACK without a code");
    if (reply->nack == 0 && AsText(request).ends_with(kUnchecked)) {
      exchange.answer.remedy =
          "set send_xx: false in the configuration, because the device may need a checksum";
    }
  } else if ((reply->type == 'A') != command.write) {
    exchange.answer =
        Unexpected(command.write ? "the device sent data as the reply to a write"
                                 : "the device sent an acknowledge as the reply to a read");
  } else if (!command.write) {
    exchange.answer = DecodeData(command, *reply, points);
    exchange.data = reply->data;
  }
  return exchange;
}

}  // namespace baudgate::protocols::spabus
