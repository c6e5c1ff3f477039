// Transparent routes on a line: requests of Modbus clients that go to a slave as they are. Waiting
// and choosing is gateway/route_queue.h's affair; the exchange itself is one like any other
// (poller_task.cpp), only that no conversation takes part.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/poller.h"
#include "gateway/poller_parts.h"

namespace baudgate {
namespace {

/// Slaves need time to carry out what none of them answers. MODBUS over Serial Line 1.02, 2.4.1:
/// 100 to 200 ms.
constexpr Duration kTurnaround = 100ms;

void AnswerAll(std::vector<RoutedRequest> requests, Outcome outcome, const std::string& reason) {
  for (RoutedRequest& request : requests) request.done({outcome, {}, reason});
}

}  // namespace

void Poller::Submit(RoutedRequest request, Now now) {
  Advance(now);
  if (!open_ || carrier_ == nullptr) {
    request.done({Outcome::line_down, {}, "the port is closed"});
    return;
  }
  routes_.Push(std::move(request));
  Settle();
}

std::size_t Poller::Forget(std::uint64_t client, Now now) {
  Advance(now);
  std::size_t forgotten = routes_.Forget(client);
  for (Work* work : {work_.get(), postponed_.get()}) {
    if (work == nullptr || !work->routed) continue;
    forgotten += std::erase_if(
        *work->routed, [&](const RoutedRequest& request) { return request.client == client; });
  }
  if (open_) Settle();
  return forgotten;
}

Poller::Device* Poller::FindSlave(std::uint8_t slave) const {
  const auto found = slaves_.find(slave);
  return found == slaves_.end() ? nullptr : found->second;
}

Poller::Device& Poller::SlaveAt(std::uint8_t slave) {
  if (Device* known = FindSlave(slave)) return *known;
  auto device = std::make_unique<Device>();
  device->index = kFirstSlave + slave;
  device->slave = slave;
  device->protocol = carrier_;
  device->serial = config_.serial;
  device->times = TimesOf(config_.timing, *carrier_, config_.serial);
  device->times.settle = kTurnaround;
  device->retries = config_.retries;
  slaves_[slave] = device.get();
  everyone_.push_back(device.get());
  routed_slaves_.push_back(std::move(device));
  return *everyone_.back();
}

/// Not while an answer to an earlier request may come that would pass for its own.
bool Poller::MayAsk(std::uint8_t slave) const {
  const Device* device = FindSlave(slave);
  return device == nullptr || (device->late_until <= now_.instant && !device->health.absent());
}

bool Poller::PickRouted(config::Priority priority) {
  return StartRouted(routes_.Take(priority, [this](std::uint8_t slave) { return MayAsk(slave); }));
}

bool Poller::StartRouted(RouteQueue::Batch batch) {
  if (batch.empty()) return false;
  Device& device = SlaveAt(batch[0].slave);
  BeginTask(device, {});
  Work& work = *work_;
  work.request.bytes = carrier_->carrier->wrap(batch[0].slave, batch[0].pdu);
  work.request.expect = carrier_->expect(work.request.bytes, config_.options);
  work.routed = std::move(batch);
  work.steps = 1;
  work.sending = true;
  return true;
}

Outcome Poller::OnRoutedFrame(View frame) {
  return carrier_->carrier->unwrap(work_->request.bytes, frame, work_->reply);
}

/// Damage on the wire is made good where that can do no harm. Silence is the client's to judge: it
/// may have better things to ask by now.
void Poller::OnRoutedFailure(const ExchangeEnd& end) {
  Work& work = *work_;
  const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
  if (damaged && work.request.expect.repeatable && work.attempts < work.device->retries &&
      !work.routed->empty() && work.routed->front().deadline > now_.instant) {
    ++work.attempts;
    work.sending = true;
    ChangeStatus(*work.device, [](DeviceStatus& status) { ++status.retries; });
    return;
  }
  FinishTask(end.outcome, end.reason);
}

void Poller::FinishRouted(Work& work, Outcome outcome, const std::string& reason) {
  const bool sent = work.exchange_began != Instant{};
  bool shared = false;
  for (RoutedRequest& request : *work.routed) {
    RoutedReply reply{outcome, {}, reason};
    if (outcome == Outcome::ok || outcome == Outcome::refused) reply.pdu = work.reply;
    reply.sent = sent;
    reply.shared = std::exchange(shared, true);
    if (sent) reply.waited = work.exchange_began - request.arrived;
    request.done(std::move(reply));
  }
}

/// A slave that does not answer is asked as often as its probes allow. Until it does, one read
/// waits to be that probe, writes wait for their deadlines, and other reads are told at once.
void Poller::AnswerForAbsent() {
  if (routes_.empty()) return;
  for (const std::uint8_t slave : routes_.Slaves()) {
    const Device* device = FindSlave(slave);
    if (device == nullptr || !device->health.absent()) continue;
    const bool asked_now = work_ && work_->device == device;
    AnswerAll(routes_.TakeReads(slave, asked_now ? 0 : 1), Outcome::no_reply,
              "slave " + std::to_string(slave) + " does not answer; it is asked now and then");
  }
}

void Poller::AnswerExpired() {
  const auto deadline = routes_.Deadline();
  if (!deadline || *deadline > now_.instant) return;
  AnswerAll(routes_.TakeExpired(now_.instant), Outcome::no_reply,
            "the request waited for the line beyond its deadline");
}

}  // namespace baudgate
