// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/reply.h"

#include <algorithm>

#include "gateway/base/checksum.h"
#include "gateway/base/text.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr std::string_view kLineBreak = "&\r\n";

/// From `<` to before the line end.
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

/// `covered` runs from `<` to the last colon.
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

/// Joins the lines of a reply: a value may be cut anywhere, so nothing comes between them.
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
  rest.remove_suffix(2);  // now from after the type to the last colon

  if (reply.type == 'A') return rest == ":" ? std::optional(reply) : std::nullopt;
  if (reply.type == 'N') {
    // No source prints the layout of a NACK; the code is taken to be its first digit.
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
  constexpr std::size_t kTail = 3;  // the last colon and the checksum
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

}  // namespace baudgate::protocols::spabus
