// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/write.h"

#include <algorithm>
#include <vector>

#include "gateway/base/text.h"
#include "gateway/bus/jobs/line_context.h"

namespace baudgate::bus {

std::unique_ptr<Job> WriteSource::Take(const Idle& idle) {
  Agenda& agenda = line_.agenda;
  // A command waits for earlier writes to the same slave through routes, for polls that go first,
  // and for a late reply of the device. Writes to an absent device are limited in number
  // (NextWriteAt), so that they do not take the line from other devices.
  std::optional<WriteCommand> next = agenda.write_queue.Take([&](const WriteCommand& command) {
    const Device& device = line_.roster.DeviceAt(command.device);
    const auto routed =
        device.slave == 0 ? std::nullopt : agenda.route_queue.FirstWrite(device.slave);
    if (routed && *routed < command.sequence) return false;
    if (agenda.schedule.GoesFirst(device.place, idle.now)) return false;
    const bool absent = device.health.absent();
    if (absent && agenda.probes.NextWriteAt(device, line_.chooser.FactsOf(idle)) > idle.now)
      return false;
    return line_.owed.late_replies.IsClear(device, idle.now);
  });
  if (!next) return nullptr;
  Device& device = line_.roster.DeviceAt(next->device);
  auto job = std::make_unique<WriteJob>(device, std::move(*next), idle.now);
  if (device.health.absent()) job->probe_budget = Probes::Kind::short_write;
  return job;
}

std::optional<Instant> WriteSource::NextAt(const Idle& idle) const {
  std::optional<Instant> soonest;
  for (const WriteCommand& command : line_.agenda.write_queue.waiting()) {
    const Device& device = line_.roster.DeviceAt(command.device);
    soonest = Soonest({soonest, line_.ClearsAt(device, idle.now)});
    if (!device.health.absent()) continue;
    const Instant allowed = line_.agenda.probes.NextWriteAt(device, line_.chooser.FactsOf(idle));
    if (allowed > idle.now) soonest = Soonest({soonest, allowed});
  }
  return soonest;
}

// ---------------------------------------------------------------- Ask: the next request

WriteJob::WriteJob(Member& who, WriteCommand command, Instant now, std::size_t next)
    : Job(who, {.kind = protocols::Task::Kind::write}, now),
      command_(std::move(command)),
      first_(next) {
  std::vector<protocols::PointValue> rest;
  for (std::size_t i = next; i < command_.writes().size(); ++i) {
    rest.push_back({command_.writes()[i].point, command_.writes()[i].raw});
  }
  protocols::Conversation& conversation = *member->device->conversation;
  rest.resize(std::clamp<std::size_t>(conversation.WritesTogether(rest), 1, rest.size()));
  next_ = next + rest.size();
  task.point = rest.front().point;
  task.value = rest.front().value;
  task.also.assign(rest.begin() + 1, rest.end());
}

// ---------------------------------------------------------------- before a request is sent

std::optional<Instant> WriteJob::LatestStart() const {
  return step.request.closes ? std::nullopt : std::optional(command_.deadline);
}

std::optional<Withheld> WriteJob::WhyNotSend(Instant now, bool held) const {
  if (step.request.closes) return std::nullopt;
  const bool untouched = first_ == 0 && !(held ? may_have_written_before_ : sent());
  if (member->in_use && untouched && command_.client_left()) {
    return Withheld{WriteEnd::not_sent, kClientLeft};
  }
  if (auto withheld = Job::WhyNotSend(now, held)) return withheld;
  return command_.why_not ? command_.why_not(now) : std::nullopt;
}

void WriteJob::NoteBefore(LineContext& line, Instant now) {
  auto& writes = std::get<Writes>(command_.kind);
  if (command_.before.empty()) {
    for (const PointWrite& write : writes) command_.before.push_back(write.before);
  }
  for (std::size_t i = first_; i < next_; ++i) {
    writes[i].before = line.tracker.KnownValue(*member->device, writes[i].point, now);
    command_.before[i] = writes[i].before;
  }
}

/// Called directly before a request is sent. If the request can write, marks the command as sent
/// and schedules read-backs of its points.
void WriteJob::OnSend(LineContext& line, Instant now) {
  may_have_written_before_ = sent();
  if (step.request.prepares || step.request.closes) return;
  if (!sent()) NoteBefore(line, now);
  command_.MoveTo(WriteState::sent);
  told_.reset();
  const Device& device = *member->device;
  std::vector<std::size_t> points;
  for (const PointWrite& write : under_way()) {
    points.push_back(write.point);
    line.agenda.write_queue.OnBegun(device.index, write.point);
  }
  line.agenda.write_queue.AddReadBacks(device.place, device.conversation->Queries(), points);
}

void WriteJob::NeverLeft() {
  Job::NeverLeft();
  if (sent() && !may_have_written_before_) command_.MoveTo(WriteState::queued);
}

// ---------------------------------------------------------------- after an exchange

void WriteJob::NoteTold(const JobEnd& told, bool may_have_acted) {
  may_have_acted_ = may_have_acted;
  // A good answer to a request that only prepares the write (opens a session, sends a password)
  // does not show whether the write has succeeded.
  const bool counts = sent() || told.outcome != Outcome::ok;
  if (counts && !step.request.closes) told_ = told;
}

void WriteJob::OnGaveUp(const ExchangeEnd& end) {
  if (!step.request.closes) told_ = {end.outcome, end.reason};
}

// ---------------------------------------------------------------- the end of the job

/// Returns how the exchange that writes the points under_way() ended.
/// * If a closing request got no answer, the earlier outcome of the write remains.
/// * If the conversation can make no further request after one that may have written, the result is
///   unknown, unless the device has refused the write.
WriteJob::PointsEnd WriteJob::EndOfPoints(const JobEnd& end) const {
  const bool cut_short = has_no_request && sent();
  const bool refused = told_ && told_->outcome != Outcome::ok;
  const bool closing = step.request.closes && !ProvesLife(end.outcome);
  PointsEnd points;
  points.keeps_told = cut_short ? refused : closing && told_;
  const Outcome last = cut_short ? Outcome::no_reply : end.outcome;
  points.outcome = points.keeps_told ? told_->outcome : last;
  if (withheld_) {
    points.how = sent() ? EndUnheard(true) : withheld_->end;
  } else {
    points.how = WriteEndOf(points.outcome, sent(), may_have_acted_);
  }
  // Only requests that prepare the write were sent; the conversation could not make the request
  // that writes.
  const bool refuses = points.outcome == Outcome::unsupported && was_sent && !sent();
  if (refuses) points.how = WriteEnd::not_sent;
  points.open = closing || cut_short;
  return points;
}

EndEffects::Write WriteJob::EndOfWrite(const JobEnd& end, Instant now) const {
  using Next = EndEffects::Write::Next;
  const PointsEnd points = EndOfPoints(end);
  const bool ok = points.how == WriteEnd::ok;
  EndEffects::Write effects;
  for (const PointWrite& one : under_way()) {
    if (ok || sent()) effects.unknown.push_back(one.point);
    if (ok) effects.confirmed.push_back(one);
  }
  // If nothing was written and the device has a trouble (such as a wrong type), the trouble is the
  // reason.
  const protocols::DeviceTrouble& trouble = member->device->conversation->trouble();
  const bool in_trouble = points.how == WriteEnd::not_sent && trouble;
  const std::string name = in_trouble ? trouble.text : InWords(Name(points.outcome));
  const auto answer = [&](WriteEnd what, const std::string& why) {
    effects.result = {what, why.empty() && what != WriteEnd::ok ? name : why, false,
                      ok ? next_ : first_, next_};
    // No request was sent, because the conversation could not encode the first point.
    effects.result.unfit = points.outcome == Outcome::unsupported && !was_sent && first_ == 0;
  };
  const bool closed = end.outcome == Outcome::line_down;
  const char* const open = points.open ? "; write access to the device may still be open: write "
                                         "again, or close the access at the device"
                                       : "";
  if (withheld_) {
    answer(points.how, withheld_->why + open);
    if (!sent()) effects.result.tried = first_;
    effects.result.changed = withheld_->changed && !sent();
  } else if (!ok && points.keeps_told) {
    answer(points.how, (told_->reason.empty() ? name : told_->reason) + open);
  } else if (!ok) {
    answer(points.how, end.reason);
  } else if (next_ == command_.writes().size()) {
    effects.next = closed ? Next::answer : Next::confirm;
    answer(WriteEnd::ok, {});
  } else if (closed) {
    answer(WriteEnd::not_sent, end.reason);
  } else if (!member->in_use) {
    answer(WriteEnd::not_sent, "the device was disabled before all points were written");
  } else if (command_.deadline <= now) {
    answer(WriteEnd::not_sent, "the deadline passed before all points were written");
  } else {
    effects.next = Next::go_on;
  }
  return effects;
}

void WriteJob::End(const JobEnd& end, Instant now, EndEffects& effects) {
  effects.polls_first = !ProvesLife(end.outcome);
  effects.write = EndOfWrite(end, now);
  effects.wrote = !effects.write->unknown.empty();
  effects.written = under_way();
}

Job::After WriteJob::Finish(LineContext& line, const JobEnd& end, Instant now) {
  using Next = EndEffects::Write::Next;
  if (withheld_ && !sent()) NoteBefore(line, now);
  EndEffects effects = EffectsOf(end, now);
  Apply(line, effects, end, now);
  const EndEffects::Write& write = *effects.write;
  Device& device = *member->device;
  line.tracker.OnPointsWritten(device, write.unknown, now);
  for (const PointWrite& one : write.confirmed) device.jumps.OnWritten(one.point, one.shown);
  if (!write.confirmed.empty()) command_.MoveTo(WriteState::reading_back);
  switch (write.next) {
    case Next::answer:
      line.accounts.devices.OnWrite(device, write.result.end, false);
      command_.End(write.result);
      return {};
    case Next::confirm:
      line.agenda.write_queue.Confirm(std::move(command_), device.place, now);
      return {};
    case Next::go_on:
      break;
  }
  command_.MoveTo(WriteState::queued);
  return {std::make_unique<WriteJob>(device, std::move(command_), now, next_), NextStep::Ask()};
}

// ---------------------------------------------------------------- how a write has ended

namespace {

/// Numbers that agree in this many digits count as equal, because devices round.
constexpr int kDigits = 3;

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
    // The output may still be moving, or the device may have limited the value. One reading does
    // not show which, so the result stays ok, with a reason.
    if (what == Comparison::between) result.reason = point.name + " shows " + ToText(shown.value);
    if (what != Comparison::another) continue;
    const std::string before = result.end == WriteEnd::differs ? result.reason + "; " : "";
    result.end = WriteEnd::differs;
    result.reason = before + point.name + " shows " + ToText(shown.value) +
                    ", although the device has confirmed that " + ToText(write.shown) +
                    " was written";
  }
  if (!std::ranges::all_of(one.command.reads(), is_read)) {
    result.read_back = false;
    result.reason = "not all requested points were read again";
  }
  return verdict;
}

}  // namespace baudgate::bus
