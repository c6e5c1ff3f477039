// SPDX-License-Identifier: Apache-2.0
#include "tests/support/talk.h"

#include "config/catalog/option_values.h"
#include "protocols/assembler.h"

namespace baudgate {

config::Options OptionsOf(const Protocol& protocol, const Settable& given) {
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

config::Device DeviceOf(const Protocol& protocol, const std::string& address,
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

Task Poll(std::size_t query) {
  return {.kind = Task::Kind::poll, .query = query, .point = kNoPoint, .value = {}};
}

Task Probe() { return {.kind = Task::Kind::probe, .query = 0, .point = kNoPoint, .value = {}}; }

Task Write(std::size_t point, Value value) {
  return {.kind = Task::Kind::write, .query = 0, .point = point, .value = std::move(value)};
}

Bytes CutFrame(FrameRule rule, Expectation expect, View bytes) {
  Assembler assembler;
  assembler.Begin(rule, std::move(expect));
  assembler.Feed(bytes);
  if (auto frame = assembler.Next(false)) return *frame;
  return assembler.Next(true).value_or(Bytes());
}

Bytes AskTwin(const Protocol& protocol, Twin& twin, const config::Options& options, View request,
              Instant now) {
  const Bytes frame = CutFrame(protocol.request_rule,
                               protocol.expect({}, ParseOptions(protocol, options)), request);
  return frame.empty() ? Bytes() : twin.Answer(frame, now);
}

Talk::Talk(const Protocol& protocol, config::Device device)
    : protocol_(&protocol),
      device_(std::make_unique<const config::Device>(std::move(device))),
      bus_(MakeBus(protocol)),
      conversation_(MakeConversation(protocol, *device_, bus_.get())) {}

Result<Request> Talk::Ask(const Task& task) {
  auto request = conversation_->Ask(task, now);
  if (!request) return request;
  request_ = *request;
  asked.push_back(request_.bytes);
  return request;
}

Answer Talk::Reply(const Task& task, View wire) {
  if (request_.expect.reply == Expectation::Reply::none) {
    Answer answer;
    answer.then = conversation_->OnSent(task, request_, now);
    return answer;
  }
  Assembler assembler;
  assembler.Begin(protocol_->reply_rule, request_.expect);
  assembler.Feed(wire);
  auto frame = assembler.Next(false);
  if (!frame) frame = assembler.Next(true);
  if (frame) return conversation_->OnFrame(task, request_, *frame, now);
  Answer answer;
  answer.outcome = assembler.blame() == Outcome::none ? Outcome::no_reply : assembler.blame();
  answer.reason = assembler.why();
  answer.then = Fail(task, answer.outcome);
  return answer;
}

Then Talk::Fail(const Task& task, Outcome outcome) {
  return conversation_->OnFailure(task, request_, outcome, now);
}

Answer Talk::Exchange(const Task& task, const Wire& wire) {
  const auto request = Ask(task);
  if (request) return Reply(task, wire(request->bytes));
  Answer answer;
  answer.outcome = Outcome::unsupported;
  answer.reason = request.error();
  return answer;
}

Answer Talk::Exchange(const Task& task, View wire) {
  return Exchange(task, [wire](View) { return Bytes(wire.begin(), wire.end()); });
}

Answer Talk::Run(const Task& task, const Wire& wire) {
  for (int step = 0; step < kMostSteps; ++step) {
    Answer answer = Exchange(task, wire);
    if (answer.then != Then::ask_again) return answer;
  }
  ADD_FAILURE() << "more steps than a task may have";
  return {};
}

Wire Talk::WireTo(Twin& twin) const {
  return [this, &twin](View request) {
    return AskTwin(*protocol_, twin, device_->options, request, now);
  };
}

}  // namespace baudgate
