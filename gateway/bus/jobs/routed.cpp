// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/routed.h"

#include <algorithm>
#include <string>

#include "gateway/base/text.h"
#include "gateway/bus/jobs/line_context.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::bus {

// ---------------------------------------------------------------- RoutedJob

std::optional<Instant> RoutedJob::LatestStart() const {
  if (batch_.empty()) return Instant{};
  return std::ranges::max(batch_, {}, &RoutedRequest::deadline).deadline;
}

bool RoutedJob::LetsPass(const LineContext& line, Instant now) const {
  return is_read_ && line.chooser.ShortWriteGoesFirst(now);
}

void RoutedJob::PutBack(LineContext& line) { line.agenda.route_queue.Return(std::move(batch_)); }

void RoutedJob::Abandon(std::uint64_t client, bool unsent) {
  const bool out = unsent ? attempt.job_was_sent : was_sent;
  std::erase_if(batch_, [client, out](const RoutedRequest& request) {
    if (request.client == client) request.done(Abandoned(out));
    return request.client == client;
  });
}

/// A reply with the right slave and function is accepted in any form, if no other reply can come.
/// Examples: Enron's registers of 32 bits, a device that limits the written value. A frame that
/// equals the request is not accepted, unless the bus is known not to echo.
Outcome RoutedJob::JudgeForm(LineContext& line, View frame, const EchoWatch& echo) {
  const WhoseReply& whose = line.owed.whose;
  const protocols::PduCarrier& carrier = *member->protocol->carrier;
  const Bytes& request = step.request.bytes;
  const Outcome outcome = carrier.unwrap(request, frame, reply_);
  attempt.answer.outcome = outcome;
  older_ = {};
  if (outcome != Outcome::unexpected) {
    const auto fits = [&](const Bytes& lost) {
      Bytes pdu;
      return ProvesLife(carrier.unwrap(lost, frame, pdu));
    };
    older_ = whose.MayBeLost(asked(), fits);
    return outcome;
  }
  odd_ = true;
  const bool may_be_bus = !echo.is_free() && std::ranges::equal(frame, request);
  const bool its_own = !reply_.empty() && whose.IsOwedAlone(asked());
  return attempt.answer.outcome = its_own && !may_be_bus ? Outcome::ok : outcome;
}

/// Returns a reply to the client if it certainly belongs to the request. A reply that seemed lost
/// may still come in place of the next reply, so a read is sent again: after n lost replies, reply
/// n + 1 to the same request is its own. Example with one lost reply:
///
///   03 3BCA 0002    03 04 …    may answer the lost request 03 3BC5 0002
///   03 3BCA 0002    03 04 …    answers 03 3BCA 0002
NextStep RoutedJob::Answer(LineContext& line, const ExchangeEnd& end, Now /*now*/) {
  const bool own = member->device != nullptr
                       ? attempt.verdict.proven || odd_
                       : line.owed.whose.OnRoutedReply(asked(), older_, ++replies_);
  if (own) return NextStep::Finish(end.outcome, {});
  if (is_read_ && step.repeats < kMostTriesMore) {
    line.accounts.devices.OnRetry(*member);
    return Repeat();
  }
  return NextStep::Finish(
      Outcome::unexpected,
      "the reply may belong to an earlier request that got no reply, so it is not used");
}

/// A read of a client whose reply was damaged is put back into the queue, as often as the member
/// has retries. After silence nothing is sent again, because the client may want something else by
/// now. The failure does not count for the state of the slave if slaves need not support this
/// function, or if the reply had an unexpected form.
NextStep RoutedJob::Fail(LineContext& line, const ExchangeEnd& end, Instant /*now*/) {
  attempt.answer = {};
  had_failure = true;
  line.tracker.HoldBack(*member);
  const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
  const bool tries_left = first() != nullptr && first()->tries < member->max_retries;
  if (damaged && is_read_ && !probe_budget && tries_left) {
    line.accounts.devices.OnRetry(*member);
    for (RoutedRequest& request : batch_) ++request.tries;
    return NextStep::BackInQueue();
  }
  if (!every_slave_answers_ || odd_) judges_member = false;
  return NextStep::Finish(end.outcome, end.reason);
}

/// True if the slave has answered exception 01, 02 or 03, so it has not carried out the request.
bool RoutedJob::IsDeclined(const JobEnd& end) const {
  return end.outcome == Outcome::refused && reply_.size() == 2 &&
         reply_[1] <= modbus::kIllegalValue;
}

void RoutedJob::End(const JobEnd& end, Instant /*now*/, EndEffects& effects) {
  effects.polls_first = !ProvesLife(end.outcome) && !is_read_;
  effects.wrote = !is_read_ && was_sent && !IsDeclined(end);
  // If the request was not sent, an outcome such as ok or refused comes from the probe before the
  // request. The client then gets no_reply.
  const bool of_probe = !was_sent && ProvesLife(end.outcome);
  const Outcome outcome = of_probe ? Outcome::no_reply : end.outcome;
  bool shared = false;
  for (RoutedRequest& request : batch_) {
    RoutedReply reply{outcome, {}, end.reason.empty() ? InWords(Name(end.outcome)) : end.reason};
    if (outcome == Outcome::ok || outcome == Outcome::refused) reply.pdu = reply_;
    reply.sent = was_sent;
    reply.shared = std::exchange(shared, true);
    if (was_sent) reply.waited = attempt.sent_at - request.arrived;
    effects.replies.emplace_back(std::move(request), std::move(reply));
  }
}

// ---------------------------------------------------------------- RoutedJobs, ShortWriteSource

Turns::Waiting RoutedJobs::Waiting() const {
  const RouteQueue& queue = agenda_.route_queue;
  if (queue.empty()) return {};
  return {.short_write = ShortWriteWaits(),
          .routed = true,
          .high_clients = queue.Clients(config::Priority::high)};
}

bool RoutedJobs::AnyMayGo(Instant now) const {
  return agenda_.route_queue.HasAny(
      [&](const RoutedRequest& request) { return MayGo(request, now); });
}

bool RoutedJobs::ShortWriteMayGo(Instant now) const {
  return agenda_.route_queue.HasAny([&](const RoutedRequest& request) {
    return RouteQueue::IsShortWrite(request) && MayGo(request, now);
  });
}

bool RoutedJobs::ShortWriteWaits() const {
  return agenda_.route_queue.HasAny([this](const RoutedRequest& request) {
    if (!RouteQueue::IsShortWrite(request)) return false;
    const Member* member = roster_.FindSlave(request.slave);
    return member == nullptr || !member->health.absent();
  });
}

bool RoutedJobs::IsLookedFor(const Member& slave, const Idle& idle) const {
  if (slave.slave == 0) return false;
  return agenda_.route_queue.HasFor(slave.slave) ||
         agenda_.routes.MayRepeatRead(slave, idle.since == idle.now, idle.now);
}

/// True if the request can be sent now. No request is sent to an offline slave, or while a late
/// reply of the slave could be mistaken for its reply. A write also waits for earlier write
/// commands to points of the slave, and for polls that go before the next write.
bool RoutedJobs::MayGo(const RoutedRequest& request, Instant now) const {
  const Member* member = roster_.FindSlave(request.slave);
  if (member != nullptr && (!late_.IsClear(*member, now) || member->health.absent())) return false;
  if (!IsWrite(request)) return true;
  const Device* device = member == nullptr ? nullptr : member->device;
  if (device != nullptr && agenda_.schedule.GoesFirst(device->place, now)) return false;
  return !agenda_.write_queue.HasAny([&](const WriteCommand& command) {
    const std::uint8_t slave = roster_.DeviceAt(command.device).slave;
    const bool same = slave != 0 && (slave == request.slave || request.slave == 0);
    return same && command.sequence < request.sequence;
  });
}

std::unique_ptr<RoutedJob> RoutedJobs::Take(config::Priority priority, Instant now) {
  const auto may_go = [&](const RoutedRequest& request) { return MayGo(request, now); };
  return JobOf(agenda_.route_queue.Take(priority, may_go), now);
}

std::unique_ptr<RoutedJob> RoutedJobs::TakeUrgent(Instant now) {
  const auto may_go = [&](const RoutedRequest& request) { return MayGo(request, now); };
  return JobOf(agenda_.route_queue.TakeUrgent(may_go), now);
}

std::unique_ptr<RoutedJob> RoutedJobs::TakeShortWrite(std::uint8_t slave, Instant now) {
  const auto to_it = [slave](const RoutedRequest& request) { return request.slave == slave; };
  return JobOf(agenda_.route_queue.TakeUrgent(to_it), now);
}

std::unique_ptr<RoutedJob> RoutedJobs::TakeProbe(const Member& slave, const Idle& idle) {
  auto job = JobOf(agenda_.route_queue.TakeFor(slave.slave), idle.now);
  if (!job && agenda_.routes.MayRepeatRead(slave, idle.since == idle.now, idle.now)) {
    job = JobOf(agenda_.routes.RepeatRead(slave), idle.now);
  }
  return job;
}

std::unique_ptr<RoutedJob> RoutedJobs::JobOf(RouteQueue::Batch batch, Instant now) {
  if (batch.empty()) return nullptr;
  const protocols::Protocol& protocol = *roster_.carrier();
  const RoutedRequest& first = batch.front();
  protocols::Request request;
  request.bytes = protocol.carrier->wrap(first.slave, first.pdu);
  Member& slave = roster_.SlaveAt(first.slave);
  request.expect = protocol.expect(request.bytes, slave.options);
  const bool common = protocol.carrier->is_common(first.pdu);
  const bool read = !IsWrite(first);
  return std::make_unique<RoutedJob>(slave, std::move(batch), common, read, std::move(request),
                                     now);
}

std::unique_ptr<Job> ShortWriteSource::Take(const Idle& idle) {
  const RouteQueue& queue = line_.agenda.route_queue;
  if (queue.empty()) return nullptr;
  if (auto job = line_.routed.TakeUrgent(idle.now)) return job;
  const Probes::Facts facts = line_.chooser.FactsOf(idle);
  for (const std::uint8_t slave : queue.Slaves()) {
    const Member* const member = line_.roster.FindSlave(slave);
    if (member == nullptr || !member->health.absent()) continue;
    if (!line_.owed.late_replies.IsClear(*member, idle.now)) continue;
    if (line_.agenda.probes.NextWriteAt(*member, facts) > idle.now) return nullptr;
    auto job = line_.routed.TakeShortWrite(slave, idle.now);
    if (!job) continue;
    job->probe_budget = Probes::Kind::short_write;
    return job;
  }
  return nullptr;
}

std::optional<Instant> ShortWriteSource::NextAt(const Idle& idle) const {
  const RouteQueue& queue = line_.agenda.route_queue;
  std::optional<Instant> soonest;
  for (const std::uint8_t slave : queue.Slaves()) {
    const Member* const member = line_.roster.FindSlave(slave);
    if (member == nullptr) continue;
    const auto clears = line_.ClearsAt(*member, idle.now);
    soonest = Soonest({soonest, clears});
    if (clears || !member->health.absent() || !queue.HasUrgent(slave)) continue;
    soonest =
        Soonest({soonest, line_.agenda.probes.NextWriteAt(*member, line_.chooser.FactsOf(idle))});
  }
  return soonest;
}

}  // namespace baudgate::bus
