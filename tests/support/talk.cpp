// SPDX-License-Identifier: Apache-2.0
#include "tests/support/talk.h"

#include "config/catalog/option_values.h"
#include "protocols/assembler.h"

namespace baudgate {

config::Options OptionsOf(const protocols::Protocol& protocol, const Settable& given) {
  config::Options options = config::DefaultOptions(protocol);
  for (const auto& [name, value] : given) {
    EXPECT_TRUE(options.Has(name)) << name;
    options.Set(name, value);
  }
  return options;
}

config::Point ReadPoint(const std::string& name, const std::string& read, config::Type type,
                        config::Group group) {
  config::Point point;
  point.name = name;
  point.read = read;
  point.type = type;
  point.group = group;
  return point;
}

config::Point WritePoint(const std::string& name, const std::string& read, const std::string& write,
                         config::Type type) {
  config::Point point = ReadPoint(name, read, type);
  point.write = write;
  point.access = read.empty() ? config::Access::write : config::Access::read_write;
  return point;
}

config::Device DeviceOf(const protocols::Protocol& protocol, const std::string& address,
                        std::vector<config::Point> points, const Settable& options) {
  config::Device device;
  device.name = "device";
  device.title = "Test Device";
  device.address = address;
  device.protocol = protocol.name;
  device.options = OptionsOf(protocol, options);
  device.points = std::move(points);
  for (const config::Point& point : device.points) {
    const Status status = protocol.check_point(point);
    EXPECT_TRUE(status) << point.name << ": " << (status ? "" : status.error());
  }
  if (protocol.check_device == nullptr) return device;
  const Status status = protocol.check_device(device);
  EXPECT_TRUE(status) << (status ? "" : status.error());
  return device;
}

protocols::Task Poll(std::size_t query) {
  return {.kind = protocols::Task::Kind::poll,
          .query = query,
          .point = protocols::kNoPoint,
          .value = {}};
}

protocols::Task Probe() {
  return {
      .kind = protocols::Task::Kind::probe, .query = 0, .point = protocols::kNoPoint, .value = {}};
}

protocols::Task Write(std::size_t point, Value value) {
  return {
      .kind = protocols::Task::Kind::write, .query = 0, .point = point, .value = std::move(value)};
}

Bytes CutFrame(protocols::FrameRule rule, protocols::Expectation expect, View bytes) {
  protocols::Assembler assembler;
  assembler.Begin(rule, std::move(expect));
  assembler.Feed(bytes);
  if (auto frame = assembler.Next(false)) return *frame;
  return assembler.Next(true).value_or(Bytes());
}

Bytes AskTwin(const protocols::Protocol& protocol, protocols::Twin& twin,
              const config::Options& options, View request, Instant now) {
  const Bytes frame = CutFrame(protocol.request_rule,
                               protocol.expect({}, ParseOptions(protocol, options)), request);
  return frame.empty() ? Bytes() : twin.Answer(frame, now);
}

Talk::Talk(const protocols::Protocol& protocol, config::Device device)
    : protocol_(&protocol),
      device_(std::make_unique<const config::Device>(std::move(device))),
      bus_(MakeBus(protocol)),
      conversation_(MakeConversation(protocol, *device_, bus_.get())) {}

Result<protocols::Request> Talk::Ask(const protocols::Task& task) {
  auto request = conversation_->Ask(task, now);
  if (!request) return request;
  request_ = *request;
  asked.push_back(request_.bytes);
  return request;
}

protocols::Answer Talk::Reply(const protocols::Task& task, View wire) {
  if (request_.expect.reply == protocols::Expectation::Reply::none) {
    protocols::Answer answer;
    answer.then = conversation_->OnSent(task, request_, now);
    return answer;
  }
  protocols::Assembler assembler;
  assembler.Begin(protocol_->reply_rule, request_.expect);
  assembler.Feed(wire);
  auto frame = assembler.Next(false);
  if (!frame) frame = assembler.Next(true);
  if (frame) return conversation_->OnFrame(task, request_, *frame, now);
  protocols::Answer answer;
  answer.outcome = assembler.blame() == Outcome::none ? Outcome::no_reply : assembler.blame();
  answer.reason = assembler.why();
  answer.then = Fail(task, answer.outcome);
  return answer;
}

protocols::Then Talk::Fail(const protocols::Task& task, Outcome outcome) {
  return conversation_->OnFailure(task, request_, outcome, now);
}

protocols::Answer Talk::Exchange(const protocols::Task& task, const Wire& wire) {
  const auto request = Ask(task);
  if (request) return Reply(task, wire(request->bytes));
  protocols::Answer answer;
  answer.outcome = Outcome::unsupported;
  answer.reason = request.error();
  return answer;
}

protocols::Answer Talk::Exchange(const protocols::Task& task, View wire) {
  return Exchange(task, [wire](View) { return Bytes(wire.begin(), wire.end()); });
}

protocols::Answer Talk::Run(const protocols::Task& task, const Wire& wire) {
  for (int step = 0; step < protocols::kMostSteps; ++step) {
    protocols::Answer answer = Exchange(task, wire);
    if (answer.then != protocols::Then::ask_again) return answer;
  }
  ADD_FAILURE() << "more steps than a task may have";
  return {};
}

Wire Talk::WireTo(protocols::Twin& twin) const {
  return [this, &twin](View request) {
    return AskTwin(*protocol_, twin, device_->options, request, now);
  };
}

}  // namespace baudgate
