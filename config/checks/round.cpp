// SPDX-License-Identifier: Apache-2.0
#include "config/checks/round.h"

#include <algorithm>

namespace baudgate::config {
namespace {

std::size_t ShortestReply(const Expectation& expect) {
  if (expect.reply == Expectation::Reply::none) return 0;
  std::size_t shortest = expect.shapes.empty() ? 1 : expect.shapes.front().min_length;
  for (const Shape& shape : expect.shapes) shortest = std::min(shortest, shape.min_length);
  return shortest;
}

}  // namespace

Round RoundOf(Group group, const Line& line, const Device& device, const Protocol& protocol,
              Bus* bus) {
  const SerialSettings serial = device.serial.value_or(line.serial);
  const Timing times = TimesInForce(line, device, protocol);
  const auto conversation = MakeConversation(protocol, device, bus);
  const auto queries = conversation->Queries();
  Round round;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (queries[i].group != group) continue;
    const auto request = conversation->Ask({Task::Kind::poll, i, kNoPoint, {}}, Instant{});
    if (!request) continue;
    const std::size_t characters = request->bytes.size() + ShortestReply(request->expect);
    round.time += *times.quiet + static_cast<int>(characters) * serial.CharacterTime();
    ++round.requests;
  }
  return round;
}

Timing TimesInForce(const Line& line, const Device& device, const Protocol& protocol) {
  const SerialSettings serial = device.serial.value_or(line.serial);
  return Resolve(Merge(device.timing, line.timing), protocol.timing(serial));
}

}  // namespace baudgate::config
