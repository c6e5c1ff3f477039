// Transparent routes on a line: requests of Modbus clients that go to a slave as they are. Waiting
// and choosing is gateway/requests/route_queue.h's affair; the exchange itself is one like any
// other (poller_task.cpp), only that no conversation takes part.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <utility>

#include "gateway/poll/poller.h"
#include "gateway/poll/poller_parts.h"

namespace baudgate {
namespace {

/// Slaves need time to carry out what none of them answers. MODBUS over Serial Line 1.02, 2.4.1:
/// 100 to 200 ms.
constexpr Duration kTurnaround = 100ms;

/// In whose name absent slaves are asked.
constexpr std::uint64_t kNobody = std::numeric_limits<std::uint64_t>::max();

std::string DoesNotAnswer(std::uint8_t slave) {
  return "slave " + std::to_string(slave) + " does not answer; it is asked now and then";
}

void AnswerAll(std::vector<RoutedRequest> requests, Outcome outcome, const std::string& reason) {
  for (RoutedRequest& request : requests) request.done({outcome, {}, reason});
}

}  // namespace

void Poller::Submit(RoutedRequest request, Now now) {
  Advance(now);
  if (!open_ || carrier_ == nullptr) {
    request.done({Outcome::line_down, {}, WhyClosed()});
    return;
  }
  request.sequence = writes_.NextSequence();
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
  device->index = device->probe_index = kFirstSlave + slave;
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

/// Not while an answer to an earlier request may come that would pass for its own, and no write
/// before an earlier one to a point of the same device.
bool Poller::MayAsk(const RoutedRequest& request) const {
  const Device* device = FindSlave(request.slave);
  if (device != nullptr && device->late_until > now_.instant) return false;
  if (device != nullptr && device->health.absent()) return false;
  return !IsWrite(request) || !writes_.HasAny([&](const WriteCommand& command) {
    const std::uint8_t slave = DeviceOf(command).slave;
    const bool same = slave != 0 && (slave == request.slave || request.slave == 0);
    return same && command.sequence < request.sequence;
  });
}

bool Poller::PickRouted(config::Priority priority) {
  return StartRouted(
      routes_.Take(priority, [this](const RoutedRequest& request) { return MayAsk(request); }));
}

/// A read that the line still waits with lets a short write pass, and what has become too late
/// meanwhile is not sent any more.
void Poller::CancelQuiet() {
  if (line_.state() != Line::State::quiet || !work_ || work_->end) return;
  if (const char* why = WhyNot(*work_)) {
    line_.Cancel();
    work_->exchange_began = {};
    BreakOff(why);
    return;
  }
  const auto urgent = [this](const RoutedRequest& request) {
    return RouteQueue::IsShortWrite(request) && MayAsk(request);
  };
  const bool read = work_->routed && !work_->routed->empty() && !IsWrite(work_->routed->front());
  if (!read || !turns_.UrgentAllowed(routes_.HasShortWrite()) || !routes_.HasAny(urgent)) return;
  line_.Cancel();
  routes_.Return(std::move(*work_->routed));
  work_.reset();
}

bool Poller::StartRouted(RouteQueue::Batch batch) {
  if (batch.empty()) return false;
  Device& device = SlaveAt(batch[0].slave);
  BeginTask(device, {});
  Work& work = *work_;
  work.request.bytes = carrier_->carrier->wrap(batch[0].slave, batch[0].pdu);
  work.request.expect = carrier_->expect(work.request.bytes, config_.options);
  work.common = carrier_->carrier->is_common(batch[0].pdu);
  work.routed = std::move(batch);
  work.steps = 1;
  work.sending = true;
  return true;
}

/// A client that asks its slaves one after the other is not there with a read for an absent one
/// when that may be probed: what it has read before is read in its place.
bool Poller::RepeatRead(const Device& device) {
  if (!MayRepeatRead(device)) return false;
  RoutedRequest read;
  read.client = kNobody;
  read.slave = device.slave;
  read.pdu = device.refused_read;
  read.deadline = Instant::max();
  read.done = [](const RoutedReply&) {};
  RouteQueue::Batch batch;
  batch.push_back(std::move(read));
  return StartRouted(std::move(batch));
}

Outcome Poller::OnRoutedFrame(View frame) {
  return carrier_->carrier->unwrap(work_->request.bytes, frame, work_->reply);
}

/// Damage on the wire is made good where that can do no harm: the read waits for its turn again.
/// Silence is the client's to judge, who may have better things to ask by now; and whoever asks for
/// what its slave does not know says nothing about the slave by it.
void Poller::OnRoutedFailure(const ExchangeEnd& end) {
  Work& work = *work_;
  Device& device = *work.device;
  HoldBack(device);
  const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
  const bool read = !work.routed->empty() && !IsWrite(work.routed->front());
  if (damaged && read && work.budget == nullptr && work.routed->front().tries < device.retries) {
    ChangeStatus(device, [](DeviceStatus& status) { ++status.retries; });
    for (RoutedRequest& request : *work.routed) ++request.tries;
    routes_.Return(std::move(*work.routed));
    work_.reset();
    return;
  }
  work.mute = work.mute || !work.common;
  FinishTask(end.outcome, end.reason);
}

void Poller::FinishRouted(Work& work, Outcome outcome, const std::string& reason) {
  const bool sent = work.exchange_began != Instant{};
  bool shared = false;
  for (RoutedRequest& request : *work.routed) {
    RoutedReply reply{outcome, {}, reason.empty() ? std::string(Name(outcome)) : reason};
    if (outcome == Outcome::ok || outcome == Outcome::refused) reply.pdu = work.reply;
    reply.sent = sent;
    reply.shared = std::exchange(shared, true);
    if (sent) reply.waited = work.exchange_began - request.arrived;
    request.done(std::move(reply));
  }
}

/// A slave that does not answer is asked as often as its probes allow. Until it does, writes wait
/// for their deadlines, and reads are told at once, but for one that may be the probe right now.
void Poller::AnswerForAbsent() {
  if (routes_.empty()) return;
  for (const std::uint8_t slave : routes_.Slaves()) {
    Device* device = FindSlave(slave);
    if (device == nullptr || !device->health.absent()) continue;
    const bool may_probe = !work_ && NextProbe() == now_.instant && Absent(probe_turn_) == device;
    std::vector<RoutedRequest> reads = routes_.TakeReads(slave, may_probe ? 1 : 0);
    for (const RoutedRequest& read : reads) {
      if (!carrier_->carrier->is_common(read.pdu)) continue;
      device->refused_read = read.pdu;
      device->refused_at = now_.instant;
    }
    AnswerAll(std::move(reads), Outcome::no_reply, DoesNotAnswer(slave));
  }
}

void Poller::AnswerExpired() {
  const auto deadline = routes_.Deadline();
  if (!deadline || *deadline > now_.instant) return;
  for (RoutedRequest& request : routes_.TakeExpired(now_.instant)) {
    const Device* device = FindSlave(request.slave);
    const bool absent = device != nullptr && device->health.absent();
    request.done({Outcome::no_reply,
                  {},
                  absent ? DoesNotAnswer(request.slave)
                         : "the request waited for the line beyond its deadline"});
  }
}

}  // namespace baudgate
