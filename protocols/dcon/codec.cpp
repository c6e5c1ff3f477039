// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/codec.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::protocols::dcon {
namespace {

// Length of a counter reply: '>', 2 checksum digits, 8 data digits.
constexpr std::size_t kCounterLine = 11;

View Raw(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::optional<std::uint8_t> HexPair(std::string_view text) {
  if (text.size() < 2) return std::nullopt;
  const auto high = HexDigit(text[0]);
  const auto low = HexDigit(text[1]);
  if (!high || !low) return std::nullopt;
  return static_cast<std::uint8_t>((*high << 4U) | *low);
}

bool FitsAtEnd(std::string_view line) {
  if (line.size() < 3) return false;
  const auto claimed = HexPair(line.substr(line.size() - 2));
  return claimed && *claimed == Sum8(Raw(line.substr(0, line.size() - 2)));
}

bool IsCounterLine(std::string_view line) {
  return line.size() == kCounterLine && line[0] == '>' &&
         std::all_of(line.begin() + 1, line.end(), [](char c) { return HexDigit(c).has_value(); });
}

bool FitsInFront(std::string_view line) {
  if (!IsCounterLine(line)) return false;
  std::string summed = ">";
  summed += line.substr(3);
  return HexPair(line.substr(1, 2)) == Sum8(Raw(summed));
}

std::optional<std::string_view> Line(View frame) {
  if (frame.size() < 2 || frame.size() > kMaxFrame || frame.back() != '\r') return std::nullopt;
  const std::string_view line = AsText(frame.first(frame.size() - 1));
  const bool printable = std::all_of(line.begin(), line.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x20 && byte < 0x7F;
  });
  if (!printable) return std::nullopt;
  return line;
}

Bytes Finish(std::string text, bool checksum) {
  if (checksum) text += HexByte(Sum8(Raw(text)));
  text += '\r';
  return ToBytes(text);
}

}  // namespace

Result<std::uint8_t> ParseAddress(std::string_view text) {
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  const auto number =
      hex ? ParseInteger<unsigned>(text.substr(2), 16) : ParseInteger<unsigned>(text);
  if (!number || *number > 255) {
    return Error{"address '" + std::string(text) +
                 "' is neither 0...255 nor hex as 0x4A; for module 4A write 74 or 0x4A"};
  }
  return static_cast<std::uint8_t>(*number);
}

bool IsHexText(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return HexDigit(c).has_value(); });
}

bool IsDecimalText(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

Bytes BuildRequest(std::string_view command, std::uint8_t address, bool checksum) {
  std::string text(command.substr(0, 1));
  text += HexByte(address);
  text += command.substr(std::min<std::size_t>(1, command.size()));
  return Finish(std::move(text), checksum);
}

Bytes BuildBroadcast(std::string_view text, bool checksum) {
  return Finish(std::string(text), checksum);
}

std::optional<Command> ParseRequest(View frame, bool checksum) {
  auto line = Line(frame);
  // Masters of ADAM modules may leave out the CR of this one broadcast.
  const std::string_view text = AsText(frame);
  if (!line && (text == "#**" || text == "#**77")) line = text;
  if (!line || std::string_view("$#%@~^").find(line->front()) == std::string_view::npos) {
    return std::nullopt;
  }
  if (checksum) {
    if (!FitsAtEnd(*line)) return std::nullopt;
    line->remove_suffix(2);
  }
  if (line->size() < 3) return std::nullopt;
  Command command;
  const std::string_view who = line->substr(1, 2);
  if (who == "**") {
    command.broadcast = true;
  } else if (const auto address = HexPair(who)) {
    command.address = *address;
  } else {
    return std::nullopt;
  }
  command.text = line->substr(0, 1);
  command.text += line->substr(3);
  return command;
}

Bytes BuildReply(std::string_view text, bool checksum) {
  return Finish(std::string(text), checksum);
}

Bytes BuildCounterReplyFront(std::string_view data) {
  std::string summed = ">";
  summed += data;
  std::string text = ">" + HexByte(Sum8(Raw(summed)));
  text += data;
  return Finish(std::move(text), false);
}

bool ChecksumFits(std::string_view line, int variant) {
  switch (variant) {
    case kNoChecksum:
      return true;
    case kChecksum:
      return FitsAtEnd(line);
    case kChecksumEither:
      return FitsAtEnd(line) || FitsInFront(line);
    case kChecksumFront:
      return IsCounterLine(line) ? FitsInFront(line) : FitsAtEnd(line);
    default:
      return false;
  }
}

std::optional<Reply> ParseReply(View frame, int variant) {
  const auto line = Line(frame);
  if (!line || std::string_view(">!?").find(line->front()) == std::string_view::npos ||
      !ChecksumFits(*line, variant)) {
    return std::nullopt;
  }
  Reply reply;
  reply.lead = line->front();
  if (variant == kNoChecksum) {
    reply.body = line->substr(1);
    return reply;
  }
  const bool front = variant != kChecksum && FitsInFront(*line);
  const bool end = !(variant == kChecksumFront && front) && FitsAtEnd(*line);
  reply.ambiguous = front && end;
  reply.body = end ? line->substr(1, line->size() - 3) : line->substr(3);
  return reply;
}

}  // namespace baudgate::protocols::dcon
