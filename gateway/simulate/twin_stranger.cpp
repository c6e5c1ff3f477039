// SPDX-License-Identifier: Apache-2.0
#include "gateway/simulate/twin_stranger.h"

#include <algorithm>
#include <memory>

#include "gateway/line/assembler.h"

namespace baudgate {
namespace {

constexpr int kAddressesToTry = 1000;
constexpr int kMostPlans = 4;  // a conversation may learn and plan anew so often

/// Requests of one length are told by their bytes, others by their lengths first.
std::size_t Distance(View a, View b) {
  constexpr std::size_t kLength = 256;
  const std::size_t common = std::min(a.size(), b.size());
  std::size_t distance = (std::max(a.size(), b.size()) - common) * kLength;
  for (std::size_t i = 0; i < common; ++i) distance += a[i] == b[i] ? 0 : 1;
  return distance;
}

std::optional<Bytes> CutFrame(const Protocol& protocol, const Request& request, View reply) {
  Assembler assembler;
  assembler.Begin(protocol.reply_rule, request.expect);
  assembler.Feed(reply);
  auto frame = assembler.Next(false);
  return frame ? frame : assembler.Next(true);
}

}  // namespace

std::optional<TwinStranger> TwinStranger::Create(const Protocol& protocol,
                                                 const config::Device& device, TwinValues& values,
                                                 Instant now) {
  const std::unique_ptr<Twin> own = protocol.make_twin(device, values);
  for (int number = 1; number <= kAddressesToTry; ++number) {
    config::Device other = device;
    other.address = std::to_string(number);
    if (!protocol.canonical_address(other.address)) continue;
    TwinStranger stranger(other.address);
    stranger.Converse(protocol, other, values, now);
    if (stranger.spoken_.empty()) continue;
    // One address may be written in several ways.
    if (own->Answer(stranger.spoken_.front().request, now).empty()) return stranger;
  }
  return std::nullopt;
}

void TwinStranger::Converse(const Protocol& protocol, const config::Device& device,
                            TwinValues& values, Instant now) {
  const std::unique_ptr<Bus> bus = MakeBus(protocol);
  const auto conversation = protocol.make_conversation(device, bus.get());
  const auto twin = protocol.make_twin(device, values);
  Perform({Task::Kind::probe, 0, kNoPoint, {}}, protocol, *conversation, *twin, now);
  for (int plan = 0; plan < kMostPlans; ++plan) {
    bool replan = false;
    for (std::size_t query = 0; query < conversation->Queries().size() && !replan; ++query) {
      replan =
          Perform({Task::Kind::poll, query, kNoPoint, {}}, protocol, *conversation, *twin, now);
    }
    if (!replan) return;
  }
}

bool TwinStranger::Perform(const Task& task, const Protocol& protocol, Conversation& conversation,
                           Twin& twin, Instant now) {
  for (int step = 0; step < kMostSteps; ++step) {
    const auto request = conversation.Ask(task, now);
    if (!request) return false;
    Bytes reply = twin.Answer(request->bytes, now);
    const auto frame = CutFrame(protocol, *request, reply);
    if (!frame) return false;
    spoken_.push_back({request->bytes, std::move(reply)});
    const Then then = conversation.OnFrame(task, *request, *frame, now).then;
    if (then != Then::ask_again) return then == Then::replan;
  }
  return false;
}

Bytes TwinStranger::ReplyTo(View request) const {
  const auto nearest =
      std::min_element(spoken_.begin(), spoken_.end(), [&](const Spoken& a, const Spoken& b) {
        return Distance(a.request, request) < Distance(b.request, request);
      });
  return nearest == spoken_.end() ? Bytes() : nearest->reply;
}

}  // namespace baudgate
