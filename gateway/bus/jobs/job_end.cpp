// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job_end.h"

#include <algorithm>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "gateway/bus/points/point_store.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::bus {

namespace {

/// Significant digits of a number that a device takes and shows.
constexpr int kDigits = 3;

/// How far what is shown may be from what was written.
Decimal Tolerance(const config::Point& point, const Decimal& written) {
  Decimal tolerance = Abs(written).Shifted(-kDigits);
  if (point.writing.step) tolerance = std::max(tolerance, *point.writing.step / 2);
  if (point.writing.decimals) {
    tolerance = std::max(tolerance, Abs(point.scale).Shifted(-*point.writing.decimals) / 2);
  }
  return tolerance;
}

}  // namespace

WriteEnd WriteEndOf(Outcome outcome, bool sent, bool may_have_acted) {
  switch (outcome) {
    case Outcome::ok:
      return sent ? WriteEnd::ok : WriteEnd::not_sent;
    case Outcome::refused:
      return may_have_acted ? WriteEnd::unknown : WriteEnd::refused;
    case Outcome::unsupported:
      return WriteEnd::refused;
    case Outcome::busy:
      return WriteEnd::busy;
    default:
      return EndUnheard(sent);
  }
}

Comparison Compare(const config::Point& point, const PointWrite& write, const Value& shown) {
  if (!HasValue(shown)) return Comparison::nothing;
  const bool is_float = point.type == config::Type::float32 || point.type == config::Type::float64;
  const bool scaled = point.scale != 1 || point.offset != 0;
  if (!is_float && !scaled)
    return ToText(shown) == ToText(write.shown) ? Comparison::written : Comparison::another;
  const auto written = Decimal::Of(write.shown);
  const auto now = Decimal::Of(shown);
  if (!written || !now) return Comparison::another;
  if (Abs(*now - *written) <= Tolerance(point, *written)) return Comparison::written;
  const auto before = Decimal::Of(write.before);
  const bool on_its_way =
      before && std::min(*before, *written) < *now && *now < std::max(*before, *written);
  return on_its_way ? Comparison::between : Comparison::another;
}

ReadBackVerdict VerdictOn(const WriteQueue::Confirmed& one, const DeviceRecord& record) {
  ReadBackVerdict verdict{{.read_back = !one.replaced, .written = one.written}};
  WriteResult& result = verdict.result;
  const auto is_read = [&](std::uint32_t point) {
    const PointRecord& shown = record.points[point];
    return shown.read_at && *shown.read_at > one.at && shown.at_best == Quality::good;
  };
  for (const PointWrite& write : one.command.writes()) {
    const config::Point& point = record.device->points[write.point];
    const PointRecord& shown = record.points[write.point];
    const bool read = is_read(write.point) && IsGood(shown.reported);
    if (!read) result.read_back = false;
    verdict.lost = verdict.lost || (!read && point.access != config::Access::write);
    const Comparison what = read ? Compare(point, write, shown.value) : Comparison::nothing;
    if (what != Comparison::written) result.read_back = false;
    // It may be on its way, or the device may have limited it: that is not known yet.
    if (what == Comparison::between) result.reason = point.name + " shows " + ToText(shown.value);
    if (what != Comparison::another) continue;
    const std::string before = result.end == WriteEnd::differs ? result.reason + "; " : "";
    result.end = WriteEnd::differs;
    result.reason = before + point.name + " shows " + ToText(shown.value) + " after " +
                    ToText(write.shown) + " was written and confirmed";
  }
  if (!std::ranges::all_of(one.command.reads(), is_read)) {
    result.read_back = false;
    result.reason = "not all was answered";
  }
  return verdict;
}

namespace {

/// Many devices are silent to requests that they do not know.
bool IsUnread(const Job& job, const JobEnd& end) {
  return job.unplanned || !ProvesLife(end.outcome) || end.outcome == Outcome::busy;
}

void EndOfPoll(const Job& job, const Job::Poll& poll, const JobEnd& end, EndEffects& effects) {
  const bool answered = ProvesLife(end.outcome);
  if (poll.group == config::Group::fast) {
    effects.fast_poll = EndEffects::FastPoll{job.wire, answered, poll.last_of_round};
  }
  if (job.judges_member) effects.poll = EndEffects::Poll{job.task.query, answered};
  // The query was not sent, or its reply may belong to another request.
  const bool soon = !job.judges_member || end.outcome == Outcome::unexpected;
  if (soon || (IsUnread(job, end) && IsSeldom(poll.group))) {
    effects.repeat = EndEffects::Repeat{poll.group, soon};
  }
}

void EndOfReadBack(const Job& job, const JobEnd& end, EndEffects& effects) {
  if (job.points.empty()) return;
  if (job.unplanned) effects.read_again = job.points;
  const config::Group group = job.member->device->config->points[job.points.front()].group;
  if (IsUnread(job, end) && IsSeldom(group)) effects.repeat = EndEffects::Repeat{group};
  // Other points of the same register may have changed, too.
  if (!ProvesLife(end.outcome)) effects.doubt = job.points;
}

void EndOfBackground(const Job& job, const JobEnd& end, EndEffects& effects) {
  const Duration took = ProvesLife(end.outcome) ? job.wire : Duration::zero();
  effects.background = EndEffects::Background{job.was_sent, took, job.proved};
}

/// The end of a write whose request, or its repetition, was not sent.
WriteEnd EndWithheld(const Job::Write& write) {
  return write.sent() ? EndUnheard(true) : write.withheld->end;
}

/// How the points of a write that are under way have ended.
struct PointsEnd {
  WriteEnd how = WriteEnd::not_sent;
  Outcome outcome = Outcome::none;
  bool keeps_told = false;  ///< it is the outcome that it had before the latest request
  bool open = false;        ///< what was opened for it may still be open
};

/// If the closing request is not answered, the write keeps the outcome that it had. If a step after
/// a request that may have written cannot be asked, only a refusal remains known.
PointsEnd EndOfPoints(const Job& job, const Job::Write& write, const JobEnd& end) {
  const bool cut_short = job.unasked && write.sent();
  const bool refused = write.told && write.told->outcome != Outcome::ok;
  const bool closing = job.step.request.closes && !ProvesLife(end.outcome);
  PointsEnd points;
  points.keeps_told = cut_short ? refused : closing && write.told;
  const Outcome last = cut_short ? Outcome::no_reply : end.outcome;
  points.outcome = points.keeps_told ? write.told->outcome : last;
  points.how = write.withheld ? EndWithheld(write)
                              : WriteEndOf(points.outcome, write.sent(), write.may_have_acted);
  // Requests that prepare the write went out, and then the conversation refused to send the write.
  const bool withheld = points.outcome == Outcome::unsupported && job.was_sent && !write.sent();
  if (withheld) points.how = WriteEnd::not_sent;
  points.open = closing || cut_short;
  return points;
}

EndEffects::Write EndOfWrite(const Job& job, const Job::Write& write, const JobEnd& end,
                             Instant now) {
  using Next = EndEffects::Write::Next;
  const PointsEnd points = EndOfPoints(job, write, end);
  const bool ok = points.how == WriteEnd::ok;
  const auto all = std::span(write.command.writes());
  EndEffects::Write effects;
  for (const PointWrite& one : all.subspan(write.first, write.next - write.first)) {
    if (ok || write.sent()) effects.unknown.push_back(one.point);
    if (ok) effects.confirmed.push_back(one);
  }
  // Nothing of it was sent: what the conversation knows of the device says why.
  const protocols::DeviceTrouble& trouble = job.member->device->conversation->trouble();
  const bool in_trouble = points.how == WriteEnd::not_sent && trouble;
  const std::string name = in_trouble ? trouble.text : std::string(Name(points.outcome));
  const auto answer = [&](WriteEnd what, const std::string& why) {
    effects.result = {what, why.empty() && what != WriteEnd::ok ? name : why, false,
                      ok ? write.next : write.first, write.next};
    // The conversation could not encode the first point, so nothing was sent for it.
    effects.result.unfit =
        points.outcome == Outcome::unsupported && !job.was_sent && write.first == 0;
  };
  const bool closed = end.outcome == Outcome::line_down;
  const char* const open = points.open ? "; what was opened for it may still be open" : "";
  if (write.withheld) {
    answer(points.how, write.withheld->why + open);
    if (!write.sent()) effects.result.tried = write.first;
  } else if (!ok && points.keeps_told) {
    const std::string& why = write.told->reason;
    answer(points.how, (why.empty() ? name : why) + open);
  } else if (!ok) {
    answer(points.how, end.reason);
  } else if (write.next == all.size()) {
    effects.next = closed ? Next::answer : Next::confirm;
    answer(WriteEnd::ok, {});
  } else if (closed) {
    answer(WriteEnd::not_sent, end.reason);
  } else if (!job.member->in_use) {
    answer(WriteEnd::not_sent, "the device was disabled before all points were written");
  } else if (write.command.deadline <= now) {
    answer(WriteEnd::not_sent, "the deadline passed before all points were written");
  } else {
    effects.next = Next::go_on;
  }
  return effects;
}

/// The slave has said that it has not even begun: with 01, 02 or 03.
bool IsDeclined(const Job::Routed& routed, const JobEnd& end) {
  return end.outcome == Outcome::refused && routed.reply.size() == 2 &&
         routed.reply[1] <= modbus::kIllegalValue;
}

void EndOfRouted(const Job& job, Job::Routed& routed, const JobEnd& end, EndEffects& effects) {
  // The probe before it was refused, not this request.
  const bool of_probe = !job.was_sent && ProvesLife(end.outcome);
  const Outcome outcome = of_probe ? Outcome::no_reply : end.outcome;
  bool shared = false;
  for (RoutedRequest& request : routed.batch) {
    RoutedReply reply{
        outcome, {}, end.reason.empty() ? std::string(Name(end.outcome)) : end.reason};
    if (outcome == Outcome::ok || outcome == Outcome::refused) reply.pdu = routed.reply;
    reply.sent = job.was_sent;
    reply.shared = std::exchange(shared, true);
    if (job.was_sent) reply.waited = job.attempt.sent_at - request.arrived;
    effects.replies.emplace_back(std::move(request), std::move(reply));
  }
}

}  // namespace

EndEffects EffectsOf(Job& job, const JobEnd& end, Instant now) {
  EndEffects effects;
  // A device that answers in an odd form is there.
  effects.judges_member = job.judges_member && !job.attempt.verdict.odd;
  const bool in_vain = !ProvesLife(end.outcome);
  if (const auto* poll = job.As<Job::Poll>()) {
    EndOfPoll(job, *poll, end, effects);
  } else if (job.As<Job::ReadBack>() != nullptr) {
    EndOfReadBack(job, end, effects);
  } else if (job.As<Job::Background>() != nullptr) {
    EndOfBackground(job, end, effects);
  } else if (const auto* write = job.As<Job::Write>()) {
    effects.polls_first = in_vain;
    effects.write = EndOfWrite(job, *write, end, now);
    effects.wrote = !effects.write->unknown.empty();
  } else if (auto* routed = job.As<Job::Routed>()) {
    effects.polls_first = in_vain && !routed->is_read;
    effects.wrote = !routed->is_read && job.was_sent && !IsDeclined(*routed, end);
    EndOfRouted(job, *routed, end, effects);
  }
  return effects;
}

namespace {

/// A point that is read once is bad. Example: another meter answers, so that all points of this one
/// are; the right one may be back tomorrow.
bool SpoilsOnce(const protocols::Answer& answer, const config::Device& device) {
  return std::ranges::any_of(answer.readings, [&](const protocols::Reading& reading) {
    return reading.point < device.points.size() && !IsGood(reading.quality) &&
           device.points[reading.point].group == config::Group::once;
  });
}

/// Takes readings that do not count yet out of `samples`. A reading that must not be asked for
/// twice counts as it comes. A probe that reads a point is no better proof of it than a poll.
JumpCheck::Result CheckJumps(const Job& job, Device& device, std::vector<Sample>& samples,
                             ReplyEffects& effects) {
  if (job.task.kind == protocols::Task::Kind::write || !job.step.request.expect.repeatable)
    return {};
  const std::vector<std::uint32_t> points = PointsOf(samples);
  JumpCheck::Result result = device.jumps.Check(samples);
  effects.rechecked = result.ask_again;
  effects.unconfirmed = result.unconfirmed;
  if (!result.ask_again) return result;
  if (job.task.kind == protocols::Task::Kind::poll) {
    effects.read_soon.push_back({device.place, job.task.query});
    return result;
  }
  // Its conversation may have another plan by now; read-backs are counted by the present one.
  const auto& queries = device.planned_queries;
  for (const std::uint32_t point : points) {
    for (std::size_t query = 0; query < queries.size(); ++query) {
      const auto& its = queries[query].points;
      if (std::ranges::find(its, point) == its.end()) continue;
      effects.read_soon.push_back({device.place, query});
    }
  }
  return result;
}

}  // namespace

ReplyEffects Intake::Take(const Job& job, Device& device, protocols::Answer answer, Instant now) {
  ReplyEffects effects;
  effects.peace = answer.wait;
  Store(job, device, answer, now, effects);
  if (answer.batch) Report(job, device, std::move(*answer.batch), effects);
  return effects;
}

/// A reply that may answer an earlier try of the same request is as old as that try; a late one is
/// as old as its request.
void Intake::Store(const Job& job, Device& device, const protocols::Answer& answer, Instant now,
                   ReplyEffects& effects) {
  const Job::Attempt& attempt = job.attempt;
  const Duration older =
      attempt.verdict.older + (attempt.after_reply_time ? attempt.round_trip : Duration());
  std::vector<Sample> samples = SamplesOf(*device.config, answer.readings);
  if (samples.empty()) return;
  const JumpCheck::Result jumps = CheckJumps(job, device, samples, effects);
  const Now at{attempt.answered_at.instant - older, attempt.answered_at.wall - older};
  store_.Update(device.index, samples, at, attempt.round_trip);
  store_.Doubt(device.index, jumps.doubtful, now);
  if (SpoilsOnce(answer, *device.config)) effects.repeat.push_back(config::Group::once);
  if (jumps.spoils) effects.repeat.push_back(*jumps.spoils);
  listener_.OnRead(device.index, PointsOf(samples), at);
  if (job.task.kind == protocols::Task::Kind::poll) effects.stored = {device.place, job.points};
}

void Intake::Report(const Job& job, const Device& device, protocols::EventBatch batch,
                    ReplyEffects& effects) {
  const EventDelivery::Exchange exchange{job.attempt.began, job.attempt.answered_at,
                                         job.task.kind == protocols::Task::Kind::background};
  const bool drained = batch.drained;
  std::optional<ReportedEvents> events = delivery_.Take(device, std::move(batch), exchange);
  if (!events) {
    if (drained) OnDrained(device, exchange.asked);
    return;
  }
  effects.hold_events = true;
  listener_.OnEvents(std::move(*events));
}

void Intake::TakeUnasked(const Device& device, Speaker::Said said) {
  if (!said.samples.empty()) {
    store_.Update(device.index, said.samples, said.received, {});
    listener_.OnRead(device.index, PointsOf(said.samples), said.received);
  }
  if (!said.warning.empty()) listener_.OnWarning(device.index, said.warning);
  if (said.events) listener_.OnEvents(std::move(*said.events));
}

void EffectApplier::ApplyReply(const Job& job, Device& device, protocols::Answer answer,
                               Instant now) {
  const ReplyEffects effects = intake_.Take(job, device, std::move(answer), now);
  if (effects.rechecked) accounts_.devices.OnRecheck(device);
  if (effects.unconfirmed) accounts_.devices.OnUnconfirmed(device);
  for (const QueryRef& query : effects.read_soon) agenda_.write_queue.AddReadBack(query);
  for (const config::Group group : effects.repeat) tracker_.Repeat(device, group, false, now);
  if (effects.stored) owed_.readings.OnStored(*effects.stored);
  if (effects.hold_events) {
    agenda_.schedule.HoldEvents(device.place);
    agenda_.background.AwaitDisk(device.place);
  }
  if (effects.peace > Duration::zero()) agenda_.schedule.Hold(device.place, now + effects.peace);
}

void EffectApplier::OnEventsKept(const Device& device, const std::string& said, Instant now) {
  agenda_.schedule.ReleaseEvents(device.place, device.conversation->HasEvents(),
                                 intake_.OnKept(device, said), now);
  agenda_.background.Release(device.place);
  tracker_.PlanBackground(device);
}

std::optional<Job::Write> EffectApplier::ApplyEnd(Job& done, EndEffects effects, const JobEnd& end,
                                                  Instant now) {
  Member& member = *done.member;
  Device* const device = member.device;
  if (const auto& background = effects.background; background && background->sent) {
    agenda_.background.NoteEnd(member.place, background->took, background->proved);
  } else if (background) {
    agenda_.background.OnUnsent(member.place);
  }
  if (device != nullptr) tracker_.PlanBackground(*device);
  if (done.probe_budget) agenda_.probes.NoteEnd(member, *done.probe_budget, done.began);
  if (effects.fast_poll) accounts_.rounds.OnPoll(member, *effects.fast_poll, now);
  if (effects.poll) {
    const auto& [query, answered] = *effects.poll;
    accounts_.devices.OnPoll(*device, query, answered, done.had_failure);
  }
  if (effects.repeat) {
    tracker_.Repeat(*device, effects.repeat->group, effects.repeat->soon, now);
  }
  if (!effects.read_again.empty()) tracker_.ReadBack(*device, effects.read_again);
  if (!effects.doubt.empty() && member.in_use) tracker_.Doubt(*device, effects.doubt, now);
  if (effects.polls_first && device != nullptr) agenda_.schedule.GoFirst(member.place);
  // Silence to a query that was never answered says something about the query, not about the
  // device.
  if (effects.judges_member && !done.blames_query)
    tracker_.OnTask(member, end.outcome, end.reason, now);
  if (effects.wrote) {
    std::span<const PointWrite> writes;
    if (const auto* const write = done.As<Job::Write>()) {
      writes = std::span(write->command.writes()).subspan(write->first, write->next - write->first);
    }
    tracker_.OnWritten(*member.protocol, done.step.request.bytes, device, writes,
                       ProvesLife(end.outcome), now);
  }
  for (auto& [request, reply] : effects.replies) request.done(std::move(reply));
  if (!effects.write) return std::nullopt;
  return OnWriteEnd(*done.As<Job::Write>(), *device, *effects.write, now);
}

std::optional<Job::Write> EffectApplier::OnWriteEnd(Job::Write& write, Device& device,
                                                    const EndEffects::Write& effects, Instant now) {
  using Next = EndEffects::Write::Next;
  tracker_.Doubt(device, effects.unknown, now);
  for (const PointWrite& one : effects.confirmed) device.jumps.OnWritten(one.point, one.shown);
  if (!effects.confirmed.empty()) write.command.MoveTo(WriteState::reading_back);
  switch (effects.next) {
    case Next::answer:
      accounts_.devices.OnWrite(device, effects.result.end, false);
      write.command.End(effects.result);
      break;
    case Next::confirm:
      agenda_.write_queue.Confirm(std::move(write.command), device.place, now);
      break;
    case Next::go_on:
      write.command.MoveTo(WriteState::queued);
      return std::move(write);
  }
  return std::nullopt;
}

}  // namespace baudgate::bus
