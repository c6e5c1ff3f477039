// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/offline/decode.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/cli/offline/make_line.h"
#include "gateway/line/assembler.h"
#include "gateway/store/conversion.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

/// In the place of a masked byte. SPA takes "XX" for any checksum.
constexpr std::uint8_t kUnknown = 'X';

struct Capture {
  Bytes request;
  Bytes reply;
  bool request_masked = false;
  bool reply_masked = false;
  std::string time;  ///< of a trace, and so is all below
  std::string device;
  std::optional<Outcome> told;  ///< how it ended when it was recorded
  std::string why;              ///< and the reason that was recorded with it
  bool ended = false;           ///< what comes now belongs to no exchange
  bool last = false;            ///< nothing stands behind it in the recording

  /// More may have come than was recorded.
  bool is_open() const { return !time.empty() && !told; }
};

Json ToJson(const Value& value) {
  return std::visit(
      [](const auto& held) -> Json {
        using T = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<T, std::monostate>) {
          return nullptr;
        } else if constexpr (std::is_same_v<T, double>) {
          return std::isfinite(held) ? Json(held) : Json(nullptr);
        } else {
          return held;
        }
      },
      value);
}

Json ToJson(const Reading& reading, const config::Device& device) {
  if (reading.point >= device.points.size()) {
    return {{"point", reading.label},
            {"value", ToJson(reading.value)},
            {"quality", reading.quality.word()}};
  }
  const config::Point& point = device.points[reading.point];
  const Sample sample = ToSample(point, reading);
  return {{"point", point.name},
          {"value", ToJson(sample.value)},
          {"unit", point.unit},
          {"quality", sample.quality.word()}};
}

/// The first whole frame of the reply, or how the reply failed.
struct Cutting {
  std::optional<Bytes> frame;
  Outcome outcome = Outcome::no_reply;
  std::string reason = "no reply";
};

Cutting CutReply(const Capture& capture, const Protocol& protocol, const config::Options& options) {
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

Answer Interpret(const Capture& capture, const Protocol& protocol, const config::Device& device,
                 Conversation& conversation) {
  const Cutting cutting = CutReply(capture, protocol, device.options);
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
                       const config::Device& device, Conversation& conversation) {
  Answer answer;
  answer.outcome = Outcome::none;
  if (capture.reply.empty()) {
    if (capture.is_open()) return EndUnknown(capture);
    answer.outcome = Outcome::no_reply;
  } else if (!capture.reply_masked) {
    Answer read = Interpret(capture, protocol, device, conversation);
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
Answer InterpretTold(const Capture& capture, const Protocol& protocol, const config::Device& device,
                     Conversation& conversation) {
  Answer answer = Interpret(capture, protocol, device, conversation);
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

Json Decode(const Capture& capture, const Protocol& protocol, const config::Device& device,
            Conversation& conversation) {
  const bool masked = capture.request_masked || capture.reply_masked;
  const Answer answer = masked ? InterpretMasked(capture, protocol, device, conversation)
                               : InterpretTold(capture, protocol, device, conversation);
  Json values = Json::array();
  for (const Reading& reading : answer.readings) values.push_back(ToJson(reading, device));
  Json json = {{"outcome", Name(answer.outcome)}, {"reason", answer.reason}, {"values", values}};
  if (!capture.time.empty()) json.update({{"time", capture.time}, {"device", capture.device}});
  return json;
}

struct Hex {
  Bytes bytes;
  bool masked = false;
};

/// "3E 31 ** 0D"; nothing when it is none.
std::optional<Hex> ParseMaskedHex(std::string_view text) {
  Hex hex;
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

/// One line: a mark and what follows it; of a trace also when and with which device.
struct Marked {
  char mark = 0;
  std::string_view rest;
  std::string_view time;
  std::string_view device;
};

std::string_view TakeWord(std::string_view& text) {
  const std::string_view word = text.substr(0, text.find(' '));
  text = Trim(text.substr(word.size()));
  return word;
}

Marked ReadMarked(std::string_view line) {
  Marked marked;
  std::string_view text = Trim(line);
  constexpr std::string_view kClock = "00:00:00.000000";
  const std::string_view first = text.substr(0, text.find(' '));
  const bool timed =
      std::equal(first.begin(), first.end(), kClock.begin(), kClock.end(),
                 [](char c, char form) { return form == '0' ? c >= '0' && c <= '9' : c == form; });
  if (timed) {
    marked.time = TakeWord(text);
    marked.device = TakeWord(text);
    if (!text.starts_with('=')) text = text.substr(0, text.find('|'));
  }
  if (text.empty()) return marked;
  marked.mark = text.front();
  marked.rest = text.substr(1);
  return marked;
}

std::optional<Outcome> OutcomeOf(std::string_view text) {
  const std::string_view word = Trim(text.substr(0, text.find_first_of(",:")));
  for (std::size_t i = 0; i < kOutcomeCount; ++i) {
    if (word == Name(static_cast<Outcome>(i))) return static_cast<Outcome>(i);
  }
  return std::nullopt;
}

/// "= corrupt, 27.3 ms: checksum": what stands behind the colon; empty: nothing does.
std::string_view ReasonOf(std::string_view text) {
  const auto colon = text.find(':');
  return colon == std::string_view::npos ? std::string_view() : Trim(text.substr(colon + 1));
}

/// An error says what is wrong with this line.
Status TakeLine(std::string_view line, std::vector<Capture>& captures) {
  const Marked marked = ReadMarked(line);
  const bool of_trace = !marked.time.empty();
  if (of_trace && !captures.empty()) captures.back().last = false;
  // Of another exchange, where a slow reader has lost records.
  const bool known =
      !captures.empty() && !captures.back().ended && captures.back().device == marked.device;
  if (marked.mark == '=' && of_trace && known) {
    Capture& capture = captures.back();
    capture.told = OutcomeOf(marked.rest);
    capture.why = ReasonOf(marked.rest);
    capture.ended = true;
  }
  if (marked.mark != '>' && marked.mark != '<') return {};
  const auto hex = ParseMaskedHex(marked.rest);
  if (!hex) return Error{"these are not hex bytes"};
  if (marked.mark == '>') {
    Capture capture;
    capture.request = hex->bytes;
    capture.request_masked = hex->masked;
    capture.time = marked.time;
    capture.device = marked.device;
    capture.last = true;
    captures.push_back(std::move(capture));
  } else if (!captures.empty() && !captures.back().ended) {
    captures.back().last = true;
    Append(captures.back().reply, hex->bytes);
    captures.back().reply_masked = captures.back().reply_masked || hex->masked;
  } else if (!of_trace) {  // a trace may begin in the midst of an exchange, and has stray bytes
    return Error{"a reply before any request (\"> hex\")"};
  }
  return {};
}

Result<std::vector<Capture>> ReadCaptures(std::istream& in) {
  std::vector<Capture> captures;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (const Status taken = TakeLine(line, captures); !taken) {
      return Error{"line " + std::to_string(number) + ": " + taken.error()};
    }
  }
  if (in.bad()) return Error{"the captures can not be read; is this a file?"};
  if (captures.empty()) return Error{"no exchange here; write lines \"> hex\" and \"< hex\""};
  return captures;
}

}  // namespace

int RunDecode(const DecodeOptions& options, const config::Catalog& catalog, std::istream& in,
              std::ostream& out, std::ostream& err) {
  // Requests name their device; this address only has to be a valid one.
  const auto line =
      MakeLine({.protocol = options.protocol,
                .devices = {{.profile = options.profile, .address = "1", .set = options.set}}},
               catalog);
  if (!line) {
    err << "baudgate: " << line.error() << "\n";
    return 3;
  }
  const config::Device& device = line->devices.front();
  const Protocol& protocol = *catalog.FindProtocol(device.protocol);
  const std::unique_ptr<Bus> bus = MakeBus(protocol);
  const std::unique_ptr<Conversation> conversation = protocol.make_conversation(device, bus.get());

  const auto captures = ReadCaptures(in);
  if (!captures) {
    err << "baudgate: " << captures.error() << "\n";
    return 2;
  }
  for (const Capture& capture : *captures) {
    if (!options.device.empty() && capture.device != options.device) continue;
    out << Decode(capture, protocol, device, *conversation)
               .dump(-1, ' ', false, Json::error_handler_t::replace)
        << "\n";
  }
  return 0;
}

}  // namespace baudgate
