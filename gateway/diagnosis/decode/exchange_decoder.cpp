// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/decode/exchange_decoder.h"

#include <algorithm>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/bus/points/point_store.h"
#include "protocols/assembler.h"

namespace baudgate {

namespace {

/// The first whole frame of the reply, or how the reply failed.
struct Cutting {
  std::optional<Bytes> frame;
  Outcome outcome = Outcome::no_reply;
  std::string reason = "no reply";
};

Cutting CutReply(const Capture& capture, const Protocol& protocol, const ParsedOptions& options) {
  Expectation expect = protocol.expect(capture.request, options);
  Cutting cutting;
  if (expect.reply == Expectation::Reply::none) cutting = {{}, Outcome::ok, {}};
  Assembler assembler;
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

Answer EndUnknown(const Capture& capture) {
  Answer answer;
  answer.outcome = Outcome::none;
  answer.reason = capture.last ? "the recording ends before this exchange"
                               : "the recording does not show how this exchange ended";
  return answer;
}

Answer Interpret(const Capture& capture, const Protocol& protocol, const ParsedOptions& options,
                 Conversation& conversation) {
  const Cutting cutting = CutReply(capture, protocol, options);
  if (cutting.frame) return conversation.Interpret(capture.request, *cutting.frame);
  if (capture.is_open() && cutting.outcome != Outcome::ok) return EndUnknown(capture);
  Answer answer;
  answer.outcome = cutting.outcome;
  answer.reason = cutting.reason;
  return answer;
}

/// Nothing can be checked over bytes that are unknown: how the exchange ended is what the trace
/// says, and values are given only where they need none of them.
Answer InterpretMasked(const Capture& capture, const Protocol& protocol,
                       const ParsedOptions& options, Conversation& conversation) {
  Answer answer;
  answer.outcome = Outcome::none;
  if (capture.reply.empty()) {
    if (capture.is_open()) return EndUnknown(capture);
    answer.outcome = Outcome::no_reply;
  } else if (!capture.reply_masked) {
    Answer read = Interpret(capture, protocol, options, conversation);
    if (ProvesLife(read.outcome)) answer = std::move(read);
  }
  if (capture.told && answer.outcome != *capture.told) {
    answer.outcome = *capture.told;
    answer.readings.clear();
  }
  answer.reason = capture.told ? "secret bytes are masked; the outcome is the recorded one"
                               : "secret bytes are masked; nothing can be checked over them";
  return answer;
}

/// Times, echoes and the exchanges before decide as well, and the recording may have left bytes
/// out: how the exchange ended is what the trace says, and values are given where the bytes agree.
Answer InterpretTold(const Capture& capture, const Protocol& protocol, const ParsedOptions& options,
                     Conversation& conversation) {
  Answer answer = Interpret(capture, protocol, options, conversation);
  if (!capture.told) return answer;
  const bool agreed = answer.outcome == *capture.told;
  if (agreed && capture.why.empty()) return answer;
  std::string reason = capture.why.empty() ? "the outcome is the recorded one" : capture.why;
  if (!agreed) {
    reason += "; by these bytes and options alone: " + std::string(Name(answer.outcome));
    if (!answer.reason.empty()) reason += " (" + answer.reason + ")";
    answer.readings.clear();
  }
  answer.outcome = *capture.told;
  answer.reason = std::move(reason);
  return answer;
}

DecodedValue ToValue(const Reading& reading, const config::Device& device) {
  if (reading.point >= device.points.size()) {
    return {.name = reading.label, .value = reading.value, .quality = reading.quality};
  }
  const config::Point& point = device.points[reading.point];
  const Sample sample = ToSample(point, reading);
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

ExchangeDecoder::ExchangeDecoder(config::Line line, const Protocol& protocol)
    : line_(std::make_unique<config::Line>(std::move(line))),
      protocol_(&protocol),
      bus_(MakeBus(protocol)),
      options_(ParseOptions(protocol, line_->devices.front().options)),
      conversation_(protocol.make_conversation(line_->devices.front(), options_, bus_.get())) {}

DecodedExchange ExchangeDecoder::Decode(const Capture& capture) {
  const bool masked = capture.request_masked || capture.reply_masked;
  Answer answer = masked ? InterpretMasked(capture, *protocol_, options_, *conversation_)
                         : InterpretTold(capture, *protocol_, options_, *conversation_);
  return ToExchange(std::move(answer));
}

DecodedExchange ExchangeDecoder::ToExchange(Answer answer) const {
  DecodedExchange decoded{answer.outcome, std::move(answer.reason), {}};
  for (const Reading& reading : answer.readings) {
    decoded.values.push_back(ToValue(reading, line_->devices.front()));
  }
  return decoded;
}

std::vector<HeardMessage> ExchangeDecoder::Hear(View bytes) {
  std::vector<HeardMessage> heard;
  const Standing& standing = *conversation_->Listens();
  Assembler assembler;
  assembler.Begin(standing.rule, standing.expect);
  std::size_t fed = 0;
  const auto add_damaged = [&](std::size_t end) {
    const std::string why(assembler.why());
    const Outcome blame = assembler.TakeBlame();
    if (blame != Outcome::none) heard.push_back({end, {blame, why, {}}});
  };
  // No more at once than a message has: more would overflow what is kept.
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
  // Not std::ranges::search: clang 14, which builds the fuzz targets, cannot compile it.
  const auto found =
      std::search(capture.reply.begin(), capture.reply.end(), frame->begin(), frame->end());
  if (found == capture.reply.end()) return capture.reply.size();
  return static_cast<std::size_t>(found - capture.reply.begin()) + frame->size();
}

}  // namespace baudgate
