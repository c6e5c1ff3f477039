// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/conversation.h"

#include <algorithm>
#include <utility>

#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/plan.h"
#include "protocols/set4tm/meter/status.h"
#include "protocols/set4tm/rules.h"

namespace baudgate::protocols::set4tm {
namespace {

const Bytes kLinkOnly = {kLinkTest};
/// Every fourth probe of a meter that has never answered uses the other checksum, in case the meter
/// is set to it. No meter takes this probe for a write.
constexpr unsigned kOtherModeEvery = 4;

}  // namespace

MeterRequests::MeterRequests(MeterParts& parts)
    : parts_(parts), address_(ParseAddress(parts.device.address).value()) {}

Request MeterRequests::Make(RequestKind kind, View pdu) {
  kind_ = kind;
  const bool broadcast = kind == RequestKind::latch;
  Request request;
  request.bytes =
      MakeFrame(broadcast ? Bytes{kBroadcast} : address_, pdu, parts_.settings.checksum);
  request.expect = Expect(request.bytes, parts_.settings);
  request.stamped = broadcast || kind == RequestKind::latch_time;
  return request;
}

Result<Request> MeterRequests::Next(const Task& task, Instant now) {
  const bool writes = task.kind == Task::Kind::write;
  const auto correction = writes
                              ? CorrectionOf(task, now)
                              : Result<Bytes>(Error{"the write has no value, so nothing was sent"});
  if (writes && !correction) return Error{correction.error()};
  if (task.kind == Task::Kind::probe && !parts_.session.has_answered() &&
      ++probes_ % kOtherModeEvery == 0) {
    return InOtherMode();
  }
  const bool may_latch = !writes && task.kind != Task::Kind::probe;
  if (may_latch && parts_.latched.IsDue(now)) return Make(RequestKind::latch, LatchPdu());
  if (auto request = ForSession(task, now)) return std::move(*request);
  return writes ? Make(RequestKind::write, *correction) : Own(task, now);
}

Request MeterRequests::InOtherMode() {
  kind_ = RequestKind::other_mode;
  Request request;
  request.bytes = MakeFrame(address_, kAskSerial, Other(parts_.settings.checksum));
  request.expect = Expect(request.bytes, parts_.settings);
  return request;
}

std::optional<Request> MeterRequests::ForSession(const Task& task, Instant now) {
  const bool probes = task.kind == Task::Kind::probe;
  const bool writes = task.kind == Task::Kind::write;
  Request request;
  switch (parts_.session.NeedBefore(probes, parts_.archive.wants_serial(), now)) {
    case MeterSession::Need::nothing:
      return std::nullopt;
    case MeterSession::Need::link:
      return Make(RequestKind::link, kLinkOnly);
    case MeterSession::Need::open:
      request = Make(RequestKind::open, parts_.session.OpenPdu());
      request.unlike_polls = true;  // the reply is a status; no other reply is a bare "00"
      // The request is repeated only if the password was accepted before: a meter that answers late
      // must not receive a wrong password three times.
      request.expect.repeatable = parts_.session.accepted();
      request.prepares = writes;
      return request;
    case MeterSession::Need::serial:
      request = Make(RequestKind::serial, kAskSerial);
      request.prepares = writes;
      return request;
  }
  return std::nullopt;
}

Request MeterRequests::Own(const Task& task, Instant now) {
  if (task.kind == Task::Kind::events) {
    if (const auto question = parts_.identification.Question({})) {
      return Make(RequestKind::question, *question);
    }
    return Make(RequestKind::record, parts_.archive.NextRecord(now));
  }
  if (AsksLatchTime(task, now)) return Make(RequestKind::latch_time, AskLatchTime());
  if (task.kind != Task::Kind::background) return Read(task.query);
  if (const auto question = parts_.archive.Question())
    return Make(RequestKind::question, *question);
  return Make(RequestKind::background, parts_.archive.NextInBackground(now));
}

Request MeterRequests::Read(std::size_t query) {
  auto [pdu, tries_masks] = parts_.reads.ReadOf(query);
  if (const auto question = parts_.identification.Question(parts_.reads.fields().Matches(pdu))) {
    return Make(RequestKind::question, *question);
  }
  parts_.reads.Number(pdu);
  Request request = Make(tries_masks ? RequestKind::trial : RequestKind::read, pdu);
  request.stamped = AsksClock(pdu);
  if (request.stamped) parts_.drift.OnAsked();
  if (tries_masks) request.expect.repeatable = false;
  return request;
}

/// True if the task asks for the time of the latest latch before anything else. A background task
/// asks also if no archive job is due: the task was due for the latch broadcast, which the task of
/// another meter has sent meanwhile.
bool MeterRequests::AsksLatchTime(const Task& task, Instant now) const {
  if (!parts_.latched.tells()) return false;
  if (task.kind == Task::Kind::background)
    return parts_.latched.WantsTime() || !parts_.archive.IsDue(now);
  return parts_.latched.WantsTime() && parts_.reads.ReadsLatched(task.query);
}

Result<Bytes> MeterRequests::CorrectionOf(const Task& task, Instant now) const {
  if (parts_.device.points[task.point].write != kCorrectsClock) {
    return Error{"SET-4TM meters can only be read; only the clock can be corrected"};
  }
  return ClockCorrection(task.value, parts_.drift, now);
}

namespace {

Answer EndedBy(Reply& reply, Then then) {
  reply.answer.then = then;
  return std::move(reply.answer);
}

}  // namespace

/// How replies to one kind of request are handled. Take handles statuses that mean the same for
/// every request (channel closed, repeat, busy) before it uses this table.
struct MeterReplies::Row {
  RequestKind kind;
  Answer (*data)(MeterReplies& its, Step& step);
  /// Handles status 01 or 03: the meter refuses the request.
  Answer (*refused)(MeterReplies& its, Step& step);
};

const MeterReplies::Row MeterReplies::kRows[] = {
    // > 05 08 00
    //   < 05 00 89 A2 61 …: TakeData has checked the serial number before
    //   < 05 01: the meter has no number
    {RequestKind::serial, [](auto& its, Step& step) { return its.TakePrelude(step); },
     [](auto& its, Step& step) {
       if (!its.IsOwn(step) || its.parts_.session.needs_number()) {
         return its.parts_.session.TakeNoSerial(std::move(step.reply.answer));
       }
       its.parts_.session.AcceptUnnamed();
       return its.ReadRefused(step);
     }},
    // > 05 08 12
    //   < 05 10 40 10 …: TakeData has stored the type before
    //   < 05 01: the task goes on, because the options may contain the constants
    {RequestKind::question, [](auto& its, Step& step) { return its.TakePrelude(step); },
     [](auto& its, Step& step) {
       its.parts_.identification.OnRefused(step.reply.pdu);
       return its.IsOwn(step) ? its.ReadRefused(step) : AskAgain();
     }},
    // > 05 08 14 50
    //   < 05 00 00 12 …: TakeData has compared the latch time before
    //   < 05 01: the latch time is not asked again until refusals are forgotten
    {RequestKind::latch_time, [](auto& its, Step& step) { return its.TakePrelude(step); },
     [](auto& its, Step& step) {
       its.parts_.latched.OnRefused();
       if (step.task.kind == Task::Kind::background) return std::move(step.reply.answer);
       return its.IsOwn(step) ? its.ReadRefused(step) : AskAgain();
     }},
    // > 05 04 01 00
    //   < 05 31 30 15 …: events
    //   < 05 01: there is no such record
    {RequestKind::record,
     [](auto& its, Step& step) {
       // A task reads several records. The channel can be opened again once for each record, not
       // only once per task.
       its.parts_.session.OnTaskEnd();
       return its.parts_.archive.TakeRecord(step.reply.data, step.now);
     },
     [](auto& its, Step& step) {
       its.parts_.session.OnTaskEnd();
       return its.parts_.archive.TakeNoRecord(std::move(step.reply.answer), step.now);
     }},
    // > 05 06 03 06 58 18
    //   < 05 14 14 08 …: records
    //   < 05 01: there is no such profile
    {RequestKind::background,
     [](auto& its, Step& step) {
       return its.parts_.archive.TakeInBackground(step.reply.data, step.now);
     },
     [](auto& its, Step& step) {
       return its.parts_.archive.TakeRefusal(std::move(step.reply.answer), step.now);
     }},
    // > 05 08 23 01 00 …
    //   < 05 01 …: all values are good, so points are read by mask from now on
    //   < 05 01: points are read by 08 1B
    {RequestKind::trial, [](auto& its, Step& step) { return its.TakeRead(step); },
     [](auto& its, Step&) {
       its.parts_.reads.EndTrial();
       return AskAgain();
     }},
    // > 05 08 1B 00 11
    //   < 05 00 00 5C 43: readings
    //   < 05 01: the points are refused
    {RequestKind::read, [](auto& its, Step& step) { return its.TakeRead(step); },
     [](auto& its, Step& step) { return its.ReadRefused(step); }},
    // > 05 03 0B 00 0A (the reply is always a status)
    //   < 05 01: the clock is not corrected
    {RequestKind::write, Plain, Plain},
    // > 05 00, > 05 01 30 30 30 30 30 30, > FE 03 08 …: the reply never has data
    {RequestKind::link, Plain, Plain},
    {RequestKind::open, Plain, Plain},
    {RequestKind::latch, Plain, Plain},
};

Answer MeterReplies::Plain(MeterReplies& /*its*/, Step& step) {
  return std::move(step.reply.answer);
}

Answer MeterReplies::Take(Step step) {
  return step.reply.status ? TakeStatus(step) : TakeData(step);
}

Answer MeterReplies::TakeData(Step& step) {
  Reply& reply = step.reply;
  parts_.session.OnGood(step.now);
  if (parts_.refused.TakeDue(step.now)) parts_.ForgetRefusals(false);
  parts_.identification.Learn(reply.pdu, reply.data);
  if (Is(reply.pdu, kAskSerial)) {
    const auto serial = ByteReader(reply.data).U32Be(0).value_or(0);
    if (parts_.session.Doubts(serial)) return AskAgain();
    if (!parts_.session.TakeSerial(serial)) return parts_.session.OtherMeter();
    parts_.archive.OnMeter(serial);
  }
  parts_.latched.Take(reply, parts_.reads);
  return RowOf(step.asked).data(*this, step);
}

Answer MeterReplies::TakeStatus(Step& step) {
  Answer& answer = step.reply.answer;
  const auto code = CodeOf(*step.reply.status);
  if (step.asked == RequestKind::open) {
    const bool probes = step.task.kind == Task::Kind::probe;
    return Unread(step, parts_.session.TakeOpened(code, std::move(answer), probes, step.now));
  }
  // After "channel closed" or "repeat" the write was not carried out, so the drift is still valid.
  if (step.asked == RequestKind::write && code != kChannelClosed && code != kRepeat)
    parts_.drift.Forget();
  if (step.asked == RequestKind::link && step.task.kind != Task::Kind::probe) {
    return parts_.session.TakePasswordRefused(std::move(answer), step.now);
  }
  if (code == kChannelClosed) return Unread(step, parts_.session.TakeClosed(std::move(answer)));
  if (code == kRepeat) return Unread(step, parts_.session.TakeRepeat(std::move(answer)));
  const bool refused = code == kNotAllowed || code == kLevelTooLow;
  if (refused) parts_.refused.OnRefused(step.now);
  if (refused || step.asked == RequestKind::trial) {
    parts_.session.OnGood(step.now);
    return RowOf(step.asked).refused(*this, step);
  }
  if (step.asked == RequestKind::serial && answer.outcome == Outcome::refused) {
    return parts_.session.TakeNoSerial(std::move(answer));
  }
  if (step.task.kind == Task::Kind::background) parts_.archive.OnFailure(step.now);
  return Unread(step, std::move(answer));
}

/// Handles a reply without values. If it ends a poll (for example, the meter has refused to open
/// the channel), the points are read again sooner than the period of their group, which may be a
/// day.
Answer MeterReplies::Unread(const Step& step, Answer answer) {
  const bool ends = step.task.kind == Task::Kind::poll && answer.then == Then::done;
  if (ends && parts_.reads.OnHeard(step.task.query, step.now)) answer.then = Then::replan;
  return answer;
}

const MeterReplies::Row& MeterReplies::RowOf(RequestKind kind) {
  return *std::ranges::find(kRows, kind, &Row::kind);
}

bool MeterReplies::IsOwn(const Step& step) const {
  return step.task.kind == Task::Kind::poll && parts_.reads.Reads(step.reply.pdu, step.task.query);
}

/// Handles data that the request of the task depends on, such as the type. A poll may read the same
/// data for its points.
Answer MeterReplies::TakePrelude(Step& step) {
  switch (step.task.kind) {
    case Task::Kind::poll:
      return TakeRead(step);
    case Task::Kind::write:
      return AskAgain();
    case Task::Kind::probe:
      return std::move(step.reply.answer);
    case Task::Kind::background:
      if (step.asked == RequestKind::latch_time) return std::move(step.reply.answer);
      break;
    case Task::Kind::events:
      break;
  }
  if (parts_.identification.trouble()) return parts_.identification.OtherType();
  if (!parts_.reads.ChooseIntegers()) return AskAgain();
  Answer answer;
  answer.then = Then::restart;
  return answer;
}

/// Handles the data of a poll: the reply to its query, or to a request that goes before the query.
Answer MeterReplies::TakeRead(Step& step) {
  Reply& reply = step.reply;
  if (AsksClock(reply.pdu)) AddDrift(step);
  if (parts_.reads.ChooseIntegers()) return EndedBy(reply, Then::restart);
  if (step.asked == RequestKind::trial) return parts_.reads.TakeTrial(std::move(reply.answer));
  if (IsOwn(step)) {
    // On a new day the readings of days and months have changed, so all queries are read again.
    const bool replans =
        reply.answer.outcome == Outcome::ok && parts_.reads.OnAnswered(step.task.query, step.now);
    if (replans && reply.answer.then == Then::done) reply.answer.then = Then::replan;
    if (parts_.identification.TakeNewDay()) reply.answer.then = Then::restart;
    return std::move(reply.answer);
  }
  if (parts_.identification.trouble()) return parts_.identification.OtherType();
  if (reply.answer.then == Then::restart) return std::move(reply.answer);
  return EndedBy(reply, Then::ask_again);
}

Answer MeterReplies::ReadRefused(Step& step) {
  Reply& reply = step.reply;
  parts_.identification.OnRefused(reply.pdu);
  if (Is(reply.pdu, AskLatchTime())) parts_.latched.OnRefused();
  if (IsMasked(reply.pdu)) {
    parts_.reads.OnMasksRefused();
    reply.answer.readings.clear();
    return EndedBy(reply, Then::replan);
  }
  if (IsFloatRead(reply.pdu) && parts_.identification.WantType()) return AskAgain();
  parts_.reads.OnRefused(step.task.query, step.now);
  return EndedBy(reply, Then::replan);
}

void MeterReplies::AddDrift(Step& step) {
  const Decoded drift =
      parts_.drift.Of(step.reply.data, step.bytes, parts_.identification.scale(), step.now);
  for (Reading& reading : step.reply.answer.readings) {
    const bool its = reading.point != kNoPoint &&
                     parts_.reads.fields().DecoderOf(reading.point) == Decoder::drift;
    if (!its) continue;
    reading.value = drift.value;
    reading.quality = drift.quality;
  }
}

namespace {

/// Returns the times of a meter with a multiplier. The multiplier stretches the silence that ends a
/// frame, and the time until the reply, which comes at most 100 ms after that silence (reference,
/// chapter 4).
config::Timing StretchedTimes(int multiplier, Duration character) {
  constexpr Duration kWithin = 100ms;
  constexpr Duration kMargin = 200ms;
  const Duration silence = multiplier * std::max<Duration>(4ms, 7 * character);
  config::Timing timing;
  timing.quiet = silence;
  timing.reply = 2 * silence + multiplier * kWithin + kMargin;
  return timing;
}

}  // namespace

MeterConversation::MeterConversation(const config::Device& device, const Settings& settings,
                                     MeterBus& bus)
    : parts_(device, settings, bus),
      reader_(parts_.settings, parts_.reads.fields(), parts_.identification),
      requests_(parts_),
      replies_(parts_) {
  OnReconnect();
}

void MeterConversation::OnReconnect() {
  parts_.refused.Forget();
  parts_.identification.OnReconnect();
  parts_.drift.Forget();
  parts_.latched.OnReconnect();
  parts_.archive.OnReconnect();
  parts_.session.OnReconnect();
  parts_.reads.OnReconnect();
}

bool MeterConversation::ForgetRefusals() {
  parts_.ForgetRefusals(true);
  return parts_.reads.ForgetRefusals();
}

std::optional<Instant> MeterConversation::BackgroundDue() const {
  const auto job = parts_.archive.due();
  const auto latch = parts_.latched.DueAt();
  return job && latch ? std::min(*job, *latch) : job ? job : latch;
}

void MeterConversation::Stamp(Request& request, Now arrives, Duration character) {
  const auto asked = SplitFrame(request.bytes, parts_.settings.checksum);
  if (AsksClock(asked->body)) {
    parts_.drift.OnSent(arrives, character);
  } else {
    parts_.latched.OnClock(arrives);
  }
}

Then MeterConversation::OnSent(const Task& /*task*/, const Request& /*request*/, Instant /*now*/) {
  parts_.latched.OnSent();
  return Then::ask_again;
}

Answer MeterConversation::OnFrame(const Task& task, const Request& request, View frame,
                                  Instant now) {
  Reply reply = reader_.Read(request.bytes, frame);
  const bool fits = !reply.pdu.empty();
  Answer answer = fits
                      ? replies_.Take({requests_.kind(), task, std::move(reply), frame.size(), now})
                      : std::move(reply.answer);
  if (answer.then != Then::ask_again) parts_.session.OnTaskEnd();
  return answer;
}

/// Handles a failed request. `request` need not be the latest: a request can fail without being
/// sent, while the reply to a probe is awaited.
Then MeterConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                  Instant now) {
  const auto parts = SplitFrame(request.bytes, parts_.settings.checksum);
  const View pdu = parts ? parts->body : View();
  const bool opens = !pdu.empty() && pdu[0] == kOpenChannel;
  const bool was_sent = outcome != Outcome::busy;
  if (task.kind == Task::Kind::events && IsJournal(pdu)) parts_.archive.OnNoRecord(outcome, now);
  if (was_sent) parts_.latched.OnFailure(pdu);
  const bool of_latch = Is(pdu, AskLatchTime());
  if (task.kind == Task::Kind::background && !of_latch) parts_.archive.OnFailure(now);
  parts_.session.OnFailure(opens, outcome, now);
  if (was_sent && requests_.kind() == RequestKind::trial && IsMasked(pdu)) {
    // Some meters are silent to unknown requests, so the trial has failed. The task goes on with 08
    // 1B, whose reply shows whether the meter is present.
    parts_.reads.EndTrial();
    return Then::ask_again;
  }
  parts_.identification.OnLost();
  return Then::done;
}

Answer MeterConversation::Interpret(View request, View frame) {
  Reply reply = reader_.Read(request, frame);
  if (!reply.data.empty()) parts_.identification.Learn(reply.pdu, reply.data);
  return std::move(reply.answer);
}

config::Timing MeterConversation::LeastTimes(Duration character) const {
  const auto multiplier = static_cast<int>(parts_.identification.multiplier());
  if (multiplier == 1) return {};
  return StretchedTimes(multiplier, character);
}

std::string MeterConversation::WhatIsLearned() const {
  const unsigned multiplier = parts_.identification.multiplier();
  return Listed({parts_.reads.Learned(), parts_.archive.Learned(), parts_.latched.Learned(),
                 multiplier > 1 ? "timeouts are multiplied by the meter's multiplier " +
                                      std::to_string(multiplier)
                                : ""});
}

}  // namespace baudgate::protocols::set4tm
