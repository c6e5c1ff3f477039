// What the SPA Bus tests share: devices built in a line, fixed values for twins, and the round trip
// of a conversation against its own twin through the real frame rules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "config/catalog/option_values.h"
#include "gateway/base/checksum.h"
#include "gateway/base/text.h"
#include "gateway/line/assembler.h"
#include "protocols/spabus/expect.h"
#include "protocols/spabus/protocol.h"
#include "tests/support/twin_exchange.h"

namespace baudgate::protocols::spabus {

using config::Access;
using config::Group;
using config::Type;

inline config::Point MakePoint(const std::string& read, Type type = Type::float32,
                               Group group = Group::fast, Access access = Access::read) {
  config::Point point;
  point.name = "p_" + read;
  point.read = read;
  point.type = type;
  point.group = group;
  point.access = access;
  return point;
}

inline config::Device MakeDevice(std::vector<config::Point> points,
                                 const std::string& address = "1") {
  config::Device device;
  device.name = "relay";
  device.title = "ABB SPAJ 140 C";
  device.address = address;
  device.options = config::DefaultOptions(SpabusProtocol());
  device.points = std::move(points);
  return device;
}

/// Whole frames out of a stream that ends in silence.
inline std::vector<Bytes> Cut(FrameRule rule, const Expectation& expect, View stream) {
  Assembler assembler;
  assembler.Begin(rule, expect);
  assembler.Feed(stream);
  std::vector<Bytes> frames;
  while (auto frame = assembler.Next(true)) frames.push_back(std::move(*frame));
  return frames;
}

/// A reply around `covered` ("<1D:0.52:"), with its checksum and line ends.
inline Bytes ReplyText(const std::string& covered) {
  Bytes frame = ToBytes(covered);
  const std::string checksum = HexByte(Xor8(frame));
  Append(frame, checksum + "\r\n");
  return frame;
}
/// `covered` with CR LF at its end and the two characters given as checksum.
inline Bytes Sealed(const std::string& covered, const std::string& checksum) {
  return ToBytes(covered + checksum + "\r\n");
}

/// A conversation and the bus that it lives on.
class Talk {
 public:
  explicit Talk(config::Device device) : device_(std::move(device)) {
    bus_ = MakeBus(SpabusProtocol());
    talk_ = SpabusProtocol().make_conversation(device_, bus_.get());
  }

  Conversation* operator->() { return talk_.get(); }
  const config::Device& device() const { return device_; }

  static Task Poll(std::size_t query) { return {Task::Kind::poll, query, kNoPoint, {}}; }
  static Task Write(std::size_t point, Value value) {
    return {Task::Kind::write, 0, point, std::move(value)};
  }

  /// The request as text, without its CR; the error where there is none.
  std::string Ask(const Task& task) {
    auto request = talk_->Ask(task, {});
    if (!request) return "error: " + request.error();
    request_ = *request;
    return std::string(AsText(View(request_.bytes).first(request_.bytes.size() - 1)));
  }
  /// The answer to the latest request; `stream` goes through the frame rule first.
  Answer Hear(const Task& task, View stream) {
    const auto frames = Cut(SpabusProtocol().reply_rule, request_.expect, stream);
    EXPECT_EQ(frames.size(), 1U) << Printable(stream);
    if (frames.empty()) return {Outcome::no_reply, "", {}, Then::done, {}};
    return talk_->OnFrame(task, request_, frames.front(), {});
  }
  Answer Hear(const Task& task, const std::string& covered) {
    return Hear(task, View(ReplyText(covered)));
  }
  Then Fail(const Task& task, Outcome outcome) {
    return talk_->OnFailure(task, request_, outcome, {});
  }
  const Request& request() const { return request_; }

 private:
  config::Device device_;
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<Conversation> talk_;
  Request request_;
};

/// One exchange of a task with a twin; the request passes the twin's frame rule, the reply ours.
inline Answer Exchange(Talk& talk, const Task& task, Twin& twin) {
  const std::string asked = talk.Ask(task);
  if (asked.starts_with("error")) return {Outcome::unsupported, asked, {}, Then::done, {}};
  const Protocol& protocol = SpabusProtocol();
  const auto requests =
      Cut(protocol.request_rule, protocol.expect({}, talk.device().options), talk.request().bytes);
  EXPECT_EQ(requests.size(), 1U);
  return talk.Hear(task, View(twin.Answer(requests.front(), {})));
}

/// Follows ask_again to the end of the task.
inline Answer Finish(Talk& talk, const Task& task, Twin& twin) {
  Answer answer = Exchange(talk, task, twin);
  for (int step = 1; answer.then == Then::ask_again && step < kMostSteps; ++step) {
    answer = Exchange(talk, task, twin);
  }
  return answer;
}

}  // namespace baudgate::protocols::spabus
