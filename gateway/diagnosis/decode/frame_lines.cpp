// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/decode/frame_lines.h"

#include <fmt/format.h>

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate {

namespace {

/// In the place of a masked byte. SPA takes "XX" for any checksum.
constexpr std::uint8_t kUnknown = 'X';

std::string_view TakeWord(std::string_view& text) {
  const std::string_view word = text.substr(0, text.find(' '));
  text = Trim(text.substr(word.size()));
  return word;
}

}  // namespace

Duration TimeOfDay(std::string_view clock) {
  constexpr std::size_t kDigits = 15;
  if (clock.size() != kDigits) return {};
  const auto part = [&](std::size_t at, std::size_t count) {
    return ParseInteger<std::int64_t>(clock.substr(at, count)).value_or(0);
  };
  return std::chrono::hours(part(0, 2)) + std::chrono::minutes(part(3, 2)) +
         std::chrono::seconds(part(6, 2)) + std::chrono::microseconds(part(9, 6));
}

Duration Between(Duration from, Duration to) { return to >= from ? to - from : to + 24h - from; }

TraceLine ReadTraceLine(std::string_view line) {
  TraceLine marked;
  std::string_view text = Trim(line);
  constexpr std::string_view kClock = "00:00:00.000000";
  const std::string_view first = text.substr(0, text.find(' '));
  const bool timed =
      std::equal(first.begin(), first.end(), kClock.begin(), kClock.end(),
                 [](char c, char form) { return form == '0' ? c >= '0' && c <= '9' : c == form; });
  if (timed) {
    marked.time = TakeWord(text);
    marked.device = TakeWord(text);
    const std::size_t bar = text.starts_with('=') ? std::string_view::npos : text.find('|');
    if (bar != std::string_view::npos) marked.shown = Trim(text.substr(bar + 1));
    text = text.substr(0, bar);
  }
  if (text.empty()) return marked;
  marked.mark = text.front();
  marked.rest = text.substr(1);
  return marked;
}

std::optional<ParsedHex> ParseMaskedHex(std::string_view text) {
  ParsedHex hex;
  std::string plain(text);
  for (auto at = plain.find("**"); at != std::string::npos; at = plain.find("**", at)) {
    plain.replace(at, 2, HexByte(kUnknown));
    hex.masked = true;
  }
  auto bytes = ParseHex(Trim(plain));
  if (!bytes) return std::nullopt;
  hex.bytes = std::move(*bytes);
  return hex;
}

std::optional<Outcome> OutcomeOf(std::string_view text) {
  const std::string_view word = Trim(text.substr(0, text.find_first_of(",:")));
  for (std::size_t i = 0; i < kOutcomeCount; ++i) {
    if (word == Name(static_cast<Outcome>(i))) return static_cast<Outcome>(i);
  }
  return std::nullopt;
}

std::string_view ReasonOf(std::string_view text) {
  const auto colon = text.find(':');
  return colon == std::string_view::npos ? std::string_view() : Trim(text.substr(colon + 1));
}

namespace {

std::string MeaningOf(const DecodedExchange& decoded) {
  std::string text;
  for (const DecodedValue& value : decoded.values) {
    text += (text.empty() ? "" : ", ") + ValueText(value);
  }
  return text;
}

}  // namespace

Decoders DecodersOf(const config::Line& line, const ProtocolFinder& find, const std::string& only) {
  Decoders decoders;
  config::Line one = line;
  for (const config::Device& device : line.devices) {
    if (!only.empty() && device.name != only) continue;
    const Protocol* const protocol = find(device.protocol);
    if (protocol == nullptr) continue;
    one.devices.assign(1, device);
    decoders.emplace(device.name, ExchangeDecoder(one, *protocol));
  }
  return decoders;
}

std::vector<std::string> FrameLines::Take(const std::string& record) {
  std::vector<std::string> lines;
  const TraceLine line = ReadTraceLine(record);
  if (line.mark == '<') {
    const bool joins = held_.device == line.device && held_.reply.size() < kMostBytes &&
                       (exchange_ || Between(held_.last, TimeOfDay(line.time)) <= kApart);
    if (!joins) FlushHeld({}, held_.reply.size(), lines);
    Hold(line);
  } else if (line.mark == '=') {
    End(line, record, lines);
  } else {
    FlushHeld({}, held_.reply.size(), lines);
    exchange_.reset();
    if (const auto hex = line.mark == '>' ? ParseMaskedHex(line.rest) : std::nullopt) {
      exchange_ = Capture{.request = hex->bytes,
                          .request_masked = hex->masked,
                          .time = std::string(line.time),
                          .device = std::string(line.device)};
      asked_ = TimeOfDay(line.time);
    }
    lines.push_back(record);
  }
  return lines;
}

std::vector<std::string> FrameLines::Flush() {
  std::vector<std::string> lines;
  FlushHeld({}, held_.reply.size(), lines);
  return lines;
}

/// A device that speaks by itself has said this: a line for each of its messages.
bool FrameLines::FlushMessages(const Held& held, std::vector<std::string>& lines) {
  const bool masked = std::ranges::find(held.masked, true) != held.masked.end();
  const auto decoder =
      std::ranges::find_if(decoders_, [](const auto& named) { return named.second.Listens(); });
  if (masked || decoder == decoders_.end()) return false;
  std::size_t from = 0;
  for (const HeardMessage& message : decoder->second.Hear(held.reply)) {
    AddLine(held, from, message.end, MeaningOf(message.decoded), lines);
    from = message.end;
  }
  AddLine(held, from, held.reply.size(), {}, lines);
  return true;
}

void FrameLines::Hold(const TraceLine& piece) {
  const auto hex = ParseMaskedHex(piece.rest);
  if (!hex) return;
  if (held_.reply.empty()) {
    held_.time = piece.time;
    held_.device = piece.device;
  }
  Append(held_.reply, hex->bytes);
  // All of a piece is secret, or nothing (gateway/records/trace/line_recorder.h).
  held_.masked.resize(held_.reply.size(), hex->masked);
  held_.shown += piece.shown;
  held_.shown.resize(held_.reply.size(), '.');  // blanks at its end
  held_.last = TimeOfDay(piece.time);
}

void FrameLines::End(const TraceLine& end, const std::string& record,
                     std::vector<std::string>& lines) {
  const bool known = exchange_ && exchange_->device == end.device;
  if (known && held_.reply.empty() && OutcomeOf(end.rest) == Outcome::no_reply &&
      ReasonOf(end.rest).empty()) {
    const Duration silence = Between(asked_, TimeOfDay(end.time));
    lines.push_back(fmt::format("{}: no reply after {} ms", record,
                                std::chrono::round<std::chrono::milliseconds>(silence).count()));
    exchange_.reset();
    return;
  }
  std::string meaning;
  std::size_t first_frame = held_.reply.size();
  const auto decoder = decoders_.find(std::string(end.device));
  if (known && !held_.reply.empty() && decoder != decoders_.end()) {
    exchange_->reply = held_.reply;
    exchange_->reply_masked = std::ranges::find(held_.masked, true) != held_.masked.end();
    exchange_->told = OutcomeOf(end.rest);
    exchange_->why = ReasonOf(end.rest);
    meaning = MeaningOf(decoder->second.Decode(*exchange_));
    first_frame = decoder->second.FirstFrame(*exchange_);
  }
  FlushHeld(meaning, first_frame, lines);
  exchange_.reset();
  lines.push_back(record);
}

void FrameLines::AddLine(const Held& held, std::size_t from, std::size_t to,
                         const std::string& meaning, std::vector<std::string>& lines) {
  if (from >= to) return;
  std::string line = held.time + " " + held.device + " <";
  for (std::size_t i = from; i < to; ++i) {
    line += " " + (held.masked[i] ? "**" : HexByte(held.reply[i]));
  }
  lines.push_back(line + " | " + (meaning.empty() ? held.shown.substr(from, to - from) : meaning));
}

/// What follows the first frame has a line of its own.
void FrameLines::FlushHeld(const std::string& meaning, std::size_t first_frame,
                           std::vector<std::string>& lines) {
  const Held held = std::exchange(held_, {});
  if (!exchange_ && !held.reply.empty() && FlushMessages(held, lines)) return;
  AddLine(held, 0, first_frame, meaning, lines);
  AddLine(held, first_frame, held.reply.size(), {}, lines);
}

}  // namespace baudgate
