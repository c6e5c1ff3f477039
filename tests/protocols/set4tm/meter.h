// A SET-4TM meter in a test: a device with points, the values it measures, and one task carried
// through conversation, frame rules and twin without any line between them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "gateway/line/assembler.h"
#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/expect.h"
#include "protocols/set4tm/protocol.h"
#include "protocols/set4tm/twin.h"
#include "tests/support/twin_exchange.h"

namespace baudgate::protocols::set4tm {

inline Bytes Hex(std::string_view text) { return *ParseHex(text); }

inline config::Options DefaultOptions() {
  config::Options options;
  options.Set("password", std::string("000000"));
  options.Set("serial_number", std::int64_t{0});
  options.Set("meter_constant", std::int64_t{0});
  options.Set("voltage_ratio", 0.0);
  options.Set("current_ratio", 0.0);
  options.Set("power_coefficient", 0.0);
  options.Set("current_coefficient", 0.0);
  options.Set("snapshot", false);
  return options;
}

inline config::Point MakePoint(std::string read, config::Group group = config::Group::fast,
                               config::Type type = config::Type::float64) {
  config::Point point;
  point.name = "p";
  point.read = std::move(read);
  point.group = group;
  point.type = type;
  return point;
}

inline config::Device MakeDevice(std::string address, std::vector<config::Point> points) {
  config::Device device;
  device.name = "meter";
  device.address = std::move(address);
  device.protocol = "set4tm";
  device.options = DefaultOptions();
  device.points = std::move(points);
  return device;
}

using Wire = std::function<Bytes(View request)>;

/// A conversation and what it was told, in order.
struct Talk {
  explicit Talk(const config::Device& meter) : device(meter), conversation(device) {}

  /// Carries the task to its end; every request goes to `wire`, silence ends it.
  Answer Run(const Task& task, const Wire& wire) {
    for (int step = 0; step < kMostSteps; ++step) {
      const auto request = conversation.Ask(task, now);
      if (!request) return Ended(Outcome::unsupported, request.error());
      asked.push_back(request->bytes);
      const Bytes frame =
          CutFrame(Set4tmProtocol().reply_rule, request->expect, wire(request->bytes));
      if (frame.empty()) {
        conversation.OnFailure(task, *request, Outcome::no_reply, now);
        return Ended(Outcome::no_reply, "silence");
      }
      Answer answer = conversation.OnFrame(task, *request, frame, now);
      if (answer.then != Then::ask_again) return answer;
    }
    ADD_FAILURE() << "more steps than a task may have";
    return Ended(Outcome::unexpected, "endless");
  }

  Answer Poll(std::size_t query, const Wire& wire) {
    return Run({.kind = Task::Kind::poll, .query = query, .point = kNoPoint, .value = {}}, wire);
  }

  /// The PDUs asked since the last call, in hex; a password shows as "01".
  std::vector<std::string> TakeAsked() {
    std::vector<std::string> pdus;
    for (const Bytes& frame : asked) {
      const std::size_t head = frame[0] == 0xFC ? 5 : 1;
      const bool open = frame[head] == 0x01;
      pdus.push_back(open ? "01" : ToHex(View(frame).subspan(head, frame.size() - head - 2)));
    }
    asked.clear();
    return pdus;
  }

  static Answer Ended(Outcome outcome, std::string reason) {
    Answer answer;
    answer.outcome = outcome;
    answer.reason = std::move(reason);
    return answer;
  }

  config::Device device;
  MeterConversation conversation;
  Instant now{std::chrono::hours(1)};
  std::vector<Bytes> asked;
};

/// The wire that a twin of `device` hangs on; `now` is read at every request.
inline Wire TwinWire(Twin& twin, const Instant& now) {
  return [&twin, &now](View request) {
    const Bytes frame =
        CutFrame(Set4tmProtocol().request_rule, Expect({}, DefaultOptions()), request);
    return frame.empty() ? Bytes() : twin.Answer(frame, now);
  };
}

}  // namespace baudgate::protocols::set4tm
