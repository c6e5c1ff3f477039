// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/decode.h"

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>

#include "gateway/assembler.h"
#include "gateway/base/text.h"
#include "gateway/cli/one_device.h"
#include "gateway/conversion.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

struct Capture {
  Bytes request;
  Bytes reply;
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
            {"quality", static_cast<int>(reading.quality)}};
  }
  const config::Point& point = device.points[reading.point];
  const Sample sample = ToSample(point, reading);
  return {{"point", point.name},
          {"value", ToJson(sample.value)},
          {"unit", point.unit},
          {"quality", static_cast<int>(sample.quality)}};
}

/// The first whole frame of the reply, or how the reply failed.
struct Cutting {
  std::optional<Bytes> frame;
  Outcome outcome = Outcome::no_reply;
  std::string reason = "no reply";
};

Cutting CutReply(const Capture& capture, const Protocol& protocol, const config::Options& options) {
  Assembler assembler;
  assembler.Begin(protocol.reply_rule, protocol.expect(capture.request, options));
  assembler.Feed(capture.reply);
  Cutting cutting;
  cutting.frame = assembler.Next(false);
  if (!cutting.frame) cutting.frame = assembler.Next(true);
  if (!cutting.frame && assembler.blame() != Outcome::none) {
    cutting.outcome = assembler.blame();
    cutting.reason = assembler.why();
  }
  return cutting;
}

Json Decode(const Capture& capture, const Protocol& protocol, const config::Device& device,
            Conversation& conversation) {
  const Cutting cutting = CutReply(capture, protocol, device.options);
  Answer answer;
  answer.outcome = cutting.outcome;
  answer.reason = cutting.reason;
  if (cutting.frame) answer = conversation.Interpret(capture.request, *cutting.frame);
  Json values = Json::array();
  for (const Reading& reading : answer.readings) values.push_back(ToJson(reading, device));
  return {{"outcome", Name(answer.outcome)}, {"reason", answer.reason}, {"values", values}};
}

Result<std::vector<Capture>> ReadCaptures(std::istream& in) {
  std::vector<Capture> captures;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string_view text = Trim(line);
    if (text.empty() || (text.front() != '>' && text.front() != '<')) continue;
    const auto bytes = ParseHex(Trim(text.substr(1)));
    if (!bytes) return Error{"line " + std::to_string(number) + ": these are not hex bytes"};
    if (text.front() == '>') {
      captures.push_back({*bytes, {}});
    } else if (captures.empty()) {
      return Error{"line " + std::to_string(number) + ": a reply before any request (\"> hex\")"};
    } else {
      Append(captures.back().reply, *bytes);
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
  auto made = MakeOneDevice({options.protocol, options.profile, "1", {}, options.set}, catalog);
  if (!made) {
    err << "baudgate: " << made.error() << "\n";
    return 3;
  }
  const config::Line& line = made->lines.front();
  const config::Device& device = line.devices.front();
  const Protocol& protocol = *catalog.FindProtocol(device.protocol);
  const std::unique_ptr<Bus> bus = protocol.make_bus(line);
  const std::unique_ptr<Conversation> conversation = bus->MakeConversation(device);

  const auto captures = ReadCaptures(in);
  if (!captures) {
    err << "baudgate: " << captures.error() << "\n";
    return 2;
  }
  for (const Capture& capture : *captures) {
    out << Decode(capture, protocol, device, *conversation)
               .dump(-1, ' ', false, Json::error_handler_t::replace)
        << "\n";
  }
  return 0;
}

}  // namespace baudgate
