// Small tools of the DCON tests: options with their defaults, devices, and one exchange between a
// conversation and a twin through the real frame rules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "gateway/line/assembler.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/conversation.h"
#include "protocols/dcon/expect.h"
#include "protocols/dcon/protocol.h"
#include "protocols/dcon/twin.h"
#include "tests/support/twin_exchange.h"

namespace baudgate::protocols::dcon {

using Settable = std::vector<std::pair<std::string, config::OptionValue>>;

/// Every declared option at its fallback, then `given`.
inline config::Options MakeOptions(const Settable& given = {}) {
  config::Options options;
  for (const OptionSpec& spec : DconProtocol().options) {
    const std::string name(spec.name);
    switch (spec.kind) {
      case OptionSpec::Kind::flag:
        options.Set(name, spec.fallback == "true");
        break;
      case OptionSpec::Kind::integer:
        options.Set(name, ParseInteger<std::int64_t>(spec.fallback).value());
        break;
      case OptionSpec::Kind::real:
        options.Set(name, ParseDecimal(spec.fallback).value());
        break;
      case OptionSpec::Kind::texts: {
        std::vector<std::string> texts;
        for (const auto part : Split(spec.fallback, ',')) texts.emplace_back(part);
        options.Set(name, std::move(texts));
        break;
      }
      default:
        options.Set(name, std::string(spec.fallback));
    }
  }
  for (const auto& [name, value] : given) {
    EXPECT_TRUE(options.Has(name)) << name;
    options.Set(name, value);
  }
  return options;
}

inline config::Point ReadPoint(const std::string& name, const std::string& read,
                               config::Type type = config::Type::float32,
                               config::Group group = config::Group::fast) {
  config::Point point;
  point.name = name;
  point.read = read;
  point.type = type;
  point.group = group;
  return point;
}

inline config::Point WritePoint(const std::string& name, const std::string& read,
                                const std::string& write,
                                config::Type type = config::Type::float32) {
  config::Point point = ReadPoint(name, read, type);
  point.write = write;
  point.access = read.empty() ? config::Access::write : config::Access::read_write;
  return point;
}

inline config::Device MakeDevice(std::vector<config::Point> points, const Settable& options = {},
                                 const std::string& address = "1") {
  config::Device device;
  device.name = "module";
  device.address = address;
  device.options = MakeOptions(options);
  device.points = std::move(points);
  for (const config::Point& point : device.points) {
    const Status status = DconProtocol().check_point(point);
    EXPECT_TRUE(status) << point.name << ": " << (status ? "" : status.error());
  }
  return device;
}

inline config::Device EightInputs(const Settable& options = {}) {
  std::vector<config::Point> points;
  for (int i = 0; i < 8; ++i) {
    points.push_back(ReadPoint("input_" + std::to_string(i), "#[" + std::to_string(i) + "]"));
  }
  Settable all = {{"checksum", true}, {"channels", std::int64_t{8}}};
  all.insert(all.end(), options.begin(), options.end());
  return MakeDevice(std::move(points), all);
}

/// What the twin puts on the wire for these bytes.
inline Bytes AskTwin(Twin& twin, const config::Device& device, View request) {
  const Bytes frame = CutFrame(DconProtocol().request_rule, Expect({}, device.options), request);
  return frame.empty() ? Bytes() : twin.Answer(frame, Instant{});
}

inline Task Poll(std::size_t query) {
  return {.kind = Task::Kind::poll, .query = query, .point = kNoPoint, .value = {}};
}
inline Task Write(std::size_t point, Value value) {
  return {.kind = Task::Kind::write, .query = 0, .point = point, .value = std::move(value)};
}

/// Asks, takes `wire` for the reply, and gives the answer; no whole frame gives what was blamed.
inline Answer Exchange(Conversation& talk, const Task& task, std::string_view wire) {
  const auto request = talk.Ask(task, Instant{});
  if (!request) {
    Answer answer;
    answer.outcome = Outcome::unsupported;
    answer.reason = request.error();
    return answer;
  }
  Assembler assembler;
  assembler.Begin(DconProtocol().reply_rule, request->expect);
  assembler.Feed(ToBytes(wire));
  const auto frame = assembler.Next(true);
  if (frame) return talk.OnFrame(task, *request, *frame, Instant{});
  Answer answer;
  answer.outcome = assembler.blame() == Outcome::none ? Outcome::no_reply : assembler.blame();
  answer.reason = assembler.why();
  answer.then = talk.OnFailure(task, *request, answer.outcome, Instant{});
  return answer;
}

inline std::string Asked(Conversation& talk, const Task& task) {
  const auto request = talk.Ask(task, Instant{});
  return request ? std::string(AsText(request->bytes)) : "error: " + request.error();
}

/// The whole task against a twin, steps included.
inline Answer RoundTrip(Conversation& talk, Twin& twin, const config::Device& device,
                        const Task& task) {
  Answer answer;
  for (int step = 0; step < kMostSteps; ++step) {
    const auto request = talk.Ask(task, Instant{});
    EXPECT_TRUE(request) << (request ? "" : request.error());
    if (!request) return answer;
    const Bytes reply = AskTwin(twin, device, request->bytes);
    const Bytes frame = CutFrame(DconProtocol().reply_rule, request->expect, reply);
    EXPECT_FALSE(frame.empty()) << Printable(request->bytes) << " got " << Printable(reply);
    if (frame.empty()) return answer;
    answer = talk.OnFrame(task, *request, frame, Instant{});
    if (answer.then != Then::ask_again) return answer;
  }
  ADD_FAILURE() << "the task does not end";
  return answer;
}

}  // namespace baudgate::protocols::dcon
