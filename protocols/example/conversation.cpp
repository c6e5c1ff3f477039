// SPDX-License-Identifier: Apache-2.0
#include "protocols/example/conversation.h"

#include "protocols/example/codec.h"
#include "protocols/example/points.h"
#include "protocols/example/rules.h"

namespace baudgate::protocols::example {

ExampleConversation::ExampleConversation(const config::Device& device)
    : device_(device), address_(ParseAddress(device.address).value()) {
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    if (device.points[i].access == config::Access::write) continue;
    queries_.push_back({.group = device.points[i].group, .points = {i}});
  }
}

Result<Request> ExampleConversation::Ask(const Task& task, Instant) {
  Message message{.device = address_};
  if (task.kind == Task::Kind::poll) {
    message.item = ParseItem(device_.points[queries_[task.query].points[0]]).value();
  } else if (task.kind == Task::Kind::write) {
    message = {'W', address_, ParseItem(device_.points[task.point]).value(),
               EncodeValue(task.value)};
  }
  Request request{.bytes = EncodeRequest(message)};
  request.expect = Expect(request.bytes);
  // The probe asks for the device type, which never changes.
  request.steady = task.kind == Task::Kind::probe;
  return request;
}

Answer ExampleConversation::OnFrame(const Task&, const Request& request, View frame, Instant) {
  return Interpret(request.bytes, frame);
}

Outcome ExampleConversation::Check(View request, View frame) const {
  const auto asked = Decode(request);
  const auto reply = Decode(frame);
  if (!asked || !reply || asked->device != reply->device || asked->item != reply->item) {
    return Outcome::unexpected;
  }
  if (reply->content != "~") return Outcome::ok;
  return asked->kind == 'W' ? Outcome::refused : Outcome::unsupported;
}

Answer ExampleConversation::Interpret(View request, View frame) {
  const Outcome outcome = Check(request, frame);
  if (outcome == Outcome::unexpected) return {outcome, "the reply answers another request"};
  const auto asked = Decode(request);
  const auto reply = Decode(frame);
  if (outcome != Outcome::ok) return {outcome, "refuses item " + std::to_string(asked->item)};
  Answer answer;
  if (asked->kind == 'W' || asked->item == 0) return answer;
  const auto [value, quality] = DecodeValue(reply->content);
  for (std::size_t i = 0; i < device_.points.size(); ++i) {
    if (ParseItem(device_.points[i]).value() != asked->item) continue;
    answer.readings.push_back({.point = i, .value = value, .quality = quality});
  }
  if (answer.readings.empty()) {
    answer.readings.push_back(
        {.value = value, .quality = quality, .label = std::to_string(asked->item)});
  }
  return answer;
}

}  // namespace baudgate::protocols::example
