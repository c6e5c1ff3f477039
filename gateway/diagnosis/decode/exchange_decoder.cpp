// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/decode/exchange_decoder.h"

#include <fmt/format.h>

#include <algorithm>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/bus/points/point_store.h"
#include "protocols/assembler.h"

namespace baudgate::diagnosis {
namespace {

/// The first whole frame of the reply; if there is none, `outcome` and `reason` say why.
struct Cutting {
  std::optional<Bytes> frame;
  Outcome outcome = Outcome::no_reply;
  std::string reason = "no reply";
};

Cutting CutReply(const Capture& capture, const protocols::Protocol& protocol,
                 const protocols::ParsedOptions& options) {
  protocols::Expectation expect = protocol.expect(capture.request, options);
  Cutting cutting;
  if (expect.reply == protocols::Expectation::Reply::none) cutting = {{}, Outcome::ok, {}};
  protocols::Assembler assembler;
  assembler.Begin(protocol.reply_rule, std::move(expect));
  assembler.Feed(capture.reply);
  cutting.frame = assembler.Next(false);
  if (!cutting.frame) cutting.frame = assembler.Next(true);
  if (!cutting.frame && assembler.blame() != Outcome::none) {
    cutting.outcome = assembler.blame();
    cutting.reason = assembler.why();
  }
  return cutting;
}

protocols::Answer EndUnknown(const Capture& capture) {
  protocols::Answer answer;
  answer.outcome = Outcome::none;
  answer.reason = capture.last ? "the recording ends before this exchange"
                               : "the recording does not show how this exchange ended";
  return answer;
}

protocols::Answer Interpret(const Capture& capture, const protocols::Protocol& protocol,
                            const protocols::ParsedOptions& options,
                            protocols::Conversation& conversation) {
  const Cutting cutting = CutReply(capture, protocol, options);
  if (cutting.frame) return conversation.Interpret(capture.request, *cutting.frame);
  if (capture.is_open() && cutting.outcome != Outcome::ok) return EndUnknown(capture);
  protocols::Answer answer;
  answer.outcome = cutting.outcome;
  answer.reason = cutting.reason;
  return answer;
}

/// Returns the answer of an exchange with masked bytes, whose check values cannot be checked. If
/// an outcome is recorded, the answer has this outcome. The answer has values only if no byte of
/// the reply is masked, and the recorded outcome does not contradict the decoded one.
protocols::Answer InterpretMasked(const Capture& capture, const protocols::Protocol& protocol,
                                  const protocols::ParsedOptions& options,
                                  protocols::Conversation& conversation) {
  protocols::Answer answer;
  answer.outcome = Outcome::none;
  if (capture.reply.empty()) {
    if (capture.is_open()) return EndUnknown(capture);
    answer.outcome = Outcome::no_reply;
  } else if (!capture.reply_masked) {
    protocols::Answer read = Interpret(capture, protocol, options, conversation);
    if (ProvesLife(read.outcome)) answer = std::move(read);
  }
  if (capture.told && answer.outcome != *capture.told) {
    answer.outcome = *capture.told;
    answer.readings.clear();
  }
  answer.reason = capture.told ? "secret bytes are masked, so the recorded outcome is shown"
                               : "secret bytes are masked, so their check value cannot be verified";
  return answer;
}

/// Returns the answer with the recorded outcome, because the outcome also depends on times, echoes
/// and earlier exchanges, and the recording may be incomplete. It contains values only if the bytes
/// alone lead to the same outcome.
protocols::Answer InterpretTold(const Capture& capture, const protocols::Protocol& protocol,
                                const protocols::ParsedOptions& options,
                                protocols::Conversation& conversation) {
  protocols::Answer answer = Interpret(capture, protocol, options, conversation);
  if (!capture.told) return answer;
  const bool agreed = answer.outcome == *capture.told;
  if (agreed && capture.why.empty()) return answer;
  std::string reason = capture.why.empty() ? "the recorded outcome is shown" : capture.why;
  if (!agreed) {
    reason += "; these bytes and options alone would mean: " + std::string(Name(answer.outcome));
    if (!answer.reason.empty()) reason += " (" + answer.reason + ")";
    answer.readings.clear();
  }
  answer.outcome = *capture.told;
  answer.reason = std::move(reason);
  return answer;
}

DecodedValue ToValue(const protocols::Reading& reading, const config::Device& device) {
  if (reading.point >= device.points.size()) {
    return {.name = reading.label, .value = reading.value, .quality = reading.quality};
  }
  const config::Point& point = device.points[reading.point];
  const bus::Sample sample = bus::ToSample(point, reading);
  return {point.name, sample.value, point.unit, sample.quality, true};
}

}  // namespace

std::string ValueText(const DecodedValue& value) {
  const auto* number = std::get_if<double>(&value.value);
  const std::string shown = number != nullptr ? FormatValue(*number) : ToText(value.value);
  std::string text = value.name + " " + (shown.empty() ? "-" : shown);
  if (!value.unit.empty()) text += " " + value.unit;
  if (!IsGood(value.quality)) text += " (" + std::string(Name(value.quality)) + ")";
  return Harmless(text);
}

ExchangeDecoder::ExchangeDecoder(config::Line line, const protocols::Protocol& protocol)
    : line_(std::make_unique<config::Line>(std::move(line))),
      protocol_(&protocol),
      bus_(MakeBus(protocol)),
      options_(ParseOptions(protocol, line_->devices.front().options)),
      conversation_(protocol.make_conversation(line_->devices.front(), options_, bus_.get())) {}

DecodedExchange ExchangeDecoder::Decode(const Capture& capture) {
  const bool masked = capture.request_masked || capture.reply_masked;
  protocols::Answer answer = masked ? InterpretMasked(capture, *protocol_, options_, *conversation_)
                                    : InterpretTold(capture, *protocol_, options_, *conversation_);
  return ToExchange(std::move(answer));
}

DecodedExchange ExchangeDecoder::ToExchange(protocols::Answer answer) const {
  DecodedExchange decoded{answer.outcome, std::move(answer.reason), {}};
  for (const protocols::Reading& reading : answer.readings) {
    decoded.values.push_back(ToValue(reading, line_->devices.front()));
  }
  return decoded;
}

std::vector<HeardMessage> ExchangeDecoder::Hear(View bytes) {
  std::vector<HeardMessage> heard;
  const protocols::Standing& standing = *conversation_->Listens();
  protocols::Assembler assembler;
  assembler.Begin(standing.rule, standing.expect);
  std::size_t fed = 0;
  const auto add_damaged = [&](std::size_t end) {
    const std::string why(assembler.why());
    const Outcome blame = assembler.TakeBlame();
    if (blame != Outcome::none) heard.push_back({end, {blame, why, {}}});
  };
  // At most one message is fed at a time, because more would exceed the space of the assembler.
  while (fed < bytes.size() || assembler.held() > 0) {
    const std::size_t next = std::min(bytes.size() - fed, standing.expect.max_bytes);
    assembler.Feed(bytes.subspan(fed, next));
    fed += next;
    while (const auto frame = assembler.Next(fed == bytes.size() && next == 0)) {
      const std::size_t end = assembler.counters().delivered + assembler.counters().discarded;
      add_damaged(end - frame->size());
      heard.push_back({end, ToExchange(conversation_->OnUnasked(*frame, {}))});
    }
    if (next == 0) break;
  }
  add_damaged(bytes.size());
  return heard;
}

std::size_t ExchangeDecoder::FirstFrame(const Capture& capture) const {
  const auto frame = CutReply(capture, *protocol_, options_).frame;
  if (!frame) return capture.reply.size();
  // std::search, not std::ranges::search: clang 14, which builds the fuzz targets, cannot compile
  // the latter.
  const auto found =
      std::search(capture.reply.begin(), capture.reply.end(), frame->begin(), frame->end());
  if (found == capture.reply.end()) return capture.reply.size();
  return static_cast<std::size_t>(found - capture.reply.begin()) + frame->size();
}

namespace {

/// The byte in place of a masked byte. SPA accepts "XX" as any checksum.
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
    const protocols::Protocol* const protocol = find(device.protocol);
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

/// Adds a line for each message of a device that sends unasked. Returns false if no device with a
/// decoder sends unasked, or if bytes are masked.
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
  // All bytes of a piece are masked, or none (gateway/records/trace/line_recorder.h).
  held_.masked.resize(held_.reply.size(), hex->masked);
  held_.shown += piece.shown;
  held_.shown.resize(held_.reply.size(), '.');  // the record lacks blanks at the end of the text
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

/// Adds lines for the stored bytes: one for the first frame, and one for the bytes after it.
void FrameLines::FlushHeld(const std::string& meaning, std::size_t first_frame,
                           std::vector<std::string>& lines) {
  const Held held = std::exchange(held_, {});
  if (!exchange_ && !held.reply.empty() && FlushMessages(held, lines)) return;
  AddLine(held, 0, first_frame, meaning, lines);
  AddLine(held, first_frame, held.reply.size(), {}, lines);
}

}  // namespace baudgate::diagnosis
