// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/conversation.h"

#include <algorithm>

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/conversation_steps.h"
#include "protocols/set4tm/expect.h"
#include "protocols/set4tm/snapshot.h"
#include "protocols/set4tm/status.h"

namespace baudgate::protocols::set4tm {
namespace {

const Bytes kLinkOnly = {kLinkTest};

/// Reference, chapter 4: the multiplier stretches the silence that ends a frame, and the answer
/// with it: no later than 100 ms behind it.
config::Timing StretchedTimes(int multiplier, Duration character) {
  constexpr Duration kWithin = 100ms;
  constexpr Duration kMargin = 200ms;
  const Duration silence = multiplier * std::max<Duration>(4ms, 7 * character);
  config::Timing timing;
  timing.quiet = silence;
  timing.reply = 2 * silence + multiplier * kWithin + kMargin;
  return timing;
}

Answer EndedBy(Reply& reply, Then then) {
  reply.answer.then = then;
  return std::move(reply.answer);
}

}  // namespace

/// What follows from a reply, by the kind of its request. Statuses that mean the same for every
/// request (channel closed, repeat, busy) are taken before (TakeStatus).
struct MeterConversation::Row {
  Kind kind;
  Answer (*data)(MeterConversation& its, Step& step);
  Answer (*refused)(MeterConversation& its, Step& step);  ///< status 01 or 03
};

const MeterConversation::Row MeterConversation::kRows[] = {
    // > 05 08 00     < 05 00 89 A2 61 …: verified before the table     < 05 01: it does not tell
    {Kind::serial, [](auto& its, Step& step) { return its.TakePrelude(step); },
     [](auto& its, Step& step) {
       if (!its.IsOwn(step) || its.session_.needs_number()) {
         return its.session_.TakeNoSerial(std::move(step.reply.answer));
       }
       its.session_.AcceptUnnamed();
       return its.ReadRefused(step);
     }},
    // > 05 08 12     < 05 10 40 10 …: learned before the table         < 05 01: options may give it
    {Kind::question, [](auto& its, Step& step) { return its.TakePrelude(step); },
     [](auto& its, Step& step) {
       its.identification_.OnRefused(step.reply.pdu);
       return its.IsOwn(step) ? its.ReadRefused(step) : AskAgain();
     }},
    // > 05 08 14 50  < 05 00 00 12 …: compared before the table        < 05 01: it never tells
    {Kind::latch_time, [](auto& its, Step& step) { return its.TakePrelude(step); },
     [](auto& its, Step& step) {
       its.latched_.OnRefused();
       if (step.task.kind == Task::Kind::background) return std::move(step.reply.answer);
       return its.IsOwn(step) ? its.ReadRefused(step) : AskAgain();
     }},
    // > 05 04 01 00  < 05 31 30 15 …: events                           < 05 01: no such record
    {Kind::record,
     [](auto& its, Step& step) {
       its.session_.OnTaskEnd();  // a task reads several records: each may open the channel anew
       return its.archive_.TakeRecord(step.reply.data, step.now);
     },
     [](auto& its, Step& step) {
       its.session_.OnTaskEnd();
       return its.archive_.TakeNoRecord(std::move(step.reply.answer), step.now);
     }},
    // > 05 06 03 06 58 18  < 05 14 14 08 …: records                    < 05 01: no such profile
    {Kind::background,
     [](auto& its, Step& step) { return its.archive_.TakeInBackground(step.reply.data, step.now); },
     [](auto& its, Step& step) {
       return its.archive_.TakeRefusal(std::move(step.reply.answer), step.now);
     }},
    // > 05 08 23 01 00 …   < 05 01 …: by mask from now on              < 05 01: by 08 1B
    {Kind::trial, [](auto& its, Step& step) { return its.TakeRead(step); },
     [](auto& its, Step&) {
       its.reads_.EndTrial();
       return AskAgain();
     }},
    // > 05 08 1B 00 11     < 05 00 00 5C 43: readings                  < 05 01: not these points
    {Kind::read, [](auto& its, Step& step) { return its.TakeRead(step); },
     [](auto& its, Step& step) { return its.ReadRefused(step); }},
    // > 05 03 0B 00 0A     answered by a status                        < 05 01: not corrected
    {Kind::write, Plain, Plain},
    // > 05 00, > 05 01 30 30 30 30 30 30, > FE 03 08 …: data never answer them
    {Kind::link, Plain, Plain},
    {Kind::open, Plain, Plain},
    {Kind::latch, Plain, Plain},
};

/// The reply means what it says, and nothing else follows.
Answer MeterConversation::Plain(MeterConversation& /*its*/, Step& step) {
  return std::move(step.reply.answer);
}

MeterConversation::MeterConversation(const config::Device& device, const Settings& settings,
                                     MeterBus& bus)
    : device_(device),
      settings_(settings),
      address_(ParseAddress(device.address).value()),
      identification_(device, settings_),
      reads_(device, settings_, identification_),
      reader_(settings_, reads_.fields(), identification_),
      latched_(settings_.latch, bus.latch),
      archive_(device.events, settings_, identification_),
      session_(settings_) {
  OnReconnect();
}

void MeterConversation::OnReconnect() {
  identification_.OnReconnect();
  drift_.Forget();
  latched_.OnReconnect();
  archive_.OnReconnect();
  session_.OnReconnect();
  reads_.OnReconnect();
}

bool MeterConversation::ForgetRefusals() {
  identification_.ForgetRefusals();
  archive_.ForgetRefusals();
  latched_.ForgetRefusals();
  return reads_.ForgetRefusals();
}

// ---------------------------------------------------------------- what is asked

Request MeterConversation::Make(Kind kind, View pdu) {
  asked_ = kind;
  const bool broadcast = kind == Kind::latch;
  Request request;
  request.bytes = MakeFrame(broadcast ? Bytes{kBroadcast} : address_, pdu, settings_.checksum);
  request.expect = Expect(request.bytes, settings_);
  request.stamped = broadcast || kind == Kind::latch_time;
  return request;
}

Result<Request> MeterConversation::Ask(const Task& task, Instant now) {
  const bool writes = task.kind == Task::Kind::write;
  const auto correction =
      writes ? CorrectionOf(task, now) : Result<Bytes>(Error{"nothing is to be written"});
  if (writes && !correction) return Error{correction.error()};
  const bool may_latch = !writes && task.kind != Task::Kind::probe;
  if (may_latch && latched_.IsDue(now)) return Make(Kind::latch, LatchPdu());
  if (auto request = AskForSession(task, now)) return std::move(*request);
  return writes ? Make(Kind::write, *correction) : AskOwn(task, now);
}

std::optional<Request> MeterConversation::AskForSession(const Task& task, Instant now) {
  const bool probes = task.kind == Task::Kind::probe;
  const bool writes = task.kind == Task::Kind::write;
  Request request;
  switch (session_.NeedBefore(probes, archive_.wants_serial(), now)) {
    case MeterSession::Need::nothing:
      return std::nullopt;
    case MeterSession::Need::link:
      return Make(Kind::link, kLinkOnly);
    case MeterSession::Need::open:
      request = Make(Kind::open, session_.OpenPdu());
      request.distinct = true;  // answered by a status; "00" answers nothing else
      // A meter that answers too late must not get a wrong password three times.
      request.expect.repeatable = session_.accepted();
      request.prepares = writes;
      return request;
    case MeterSession::Need::serial:
      request = Make(Kind::serial, kAskSerial);
      request.prepares = writes;
      return request;
  }
  return std::nullopt;
}

Request MeterConversation::AskOwn(const Task& task, Instant now) {
  if (task.kind == Task::Kind::events) {
    if (const auto question = identification_.Question({})) {
      return Make(Kind::question, *question);
    }
    return Make(Kind::record, archive_.NextRecord(now));
  }
  if (AsksLatchTime(task, now)) return Make(Kind::latch_time, AskLatchTime());
  if (task.kind != Task::Kind::background) return AskRead(task.query);
  if (const auto question = archive_.Question()) return Make(Kind::question, *question);
  return Make(Kind::background, archive_.NextInBackground(now));
}

Request MeterConversation::AskRead(std::size_t query) {
  auto [pdu, tries_masks] = reads_.ReadOf(query);
  if (const auto question = identification_.Question(reads_.fields().Matches(pdu))) {
    return Make(Kind::question, *question);
  }
  reads_.Number(pdu);
  Request request = Make(tries_masks ? Kind::trial : Kind::read, pdu);
  request.stamped = AsksClock(pdu);
  if (request.stamped) drift_.OnAsked();
  if (tries_masks) request.expect.repeatable = false;
  return request;
}

/// In the background where no job is due: another meter's task may have sent the broadcast.
bool MeterConversation::AsksLatchTime(const Task& task, Instant now) const {
  if (!latched_.tells()) return false;
  if (task.kind == Task::Kind::background) return latched_.WantsTime() || !archive_.IsDue(now);
  return latched_.WantsTime() && reads_.ReadsLatched(task.query);
}

Result<Bytes> MeterConversation::CorrectionOf(const Task& task, Instant now) const {
  if (device_.points[task.point].write != kCorrectsClock) {
    return Error{"SET-4TM meters are read only here"};
  }
  return ClockCorrection(task.value, drift_, now);
}

std::optional<Instant> MeterConversation::BackgroundDue() const {
  const auto job = archive_.due();
  const auto latch = latched_.DueAt();
  return job && latch ? std::min(*job, *latch) : job ? job : latch;
}

void MeterConversation::Stamp(Request& request, Now arrives, Duration character) {
  const auto asked = SplitFrame(request.bytes, settings_.checksum);
  if (AsksClock(asked->body)) {
    drift_.OnSent(arrives, character);
  } else {
    latched_.OnClock(arrives);
  }
}

Then MeterConversation::OnSent(const Task& /*task*/, const Request& /*request*/, Instant /*now*/) {
  latched_.OnSent();
  return Then::ask_again;
}

// ---------------------------------------------------------------- what comes

Answer MeterConversation::OnFrame(const Task& task, const Request& request, View frame,
                                  Instant now) {
  Step step{task, reader_.Read(request.bytes, frame), frame.size(), now};
  const bool fits = !step.reply.pdu.empty();
  Answer answer = !fits               ? std::move(step.reply.answer)
                  : step.reply.status ? TakeStatus(step)
                                      : TakeData(step);
  if (answer.then != Then::ask_again) session_.OnTaskEnd();
  return answer;
}

Answer MeterConversation::TakeData(Step& step) {
  Reply& reply = step.reply;
  session_.OnGood(step.now);
  identification_.Learn(reply.pdu, reply.data);
  if (Is(reply.pdu, kAskSerial)) {
    const auto serial = ByteReader(reply.data).U32Be(0).value_or(0);
    if (!session_.TakeSerial(serial)) return session_.OtherMeter();
    archive_.OnMeter(serial);
  }
  latched_.Take(reply, reads_);
  return RowOf(asked_).data(*this, step);
}

Answer MeterConversation::TakeStatus(Step& step) {
  Answer& answer = step.reply.answer;
  const auto code = CodeOf(*step.reply.status);
  if (asked_ == Kind::open) {
    const bool probes = step.task.kind == Task::Kind::probe;
    return session_.TakeOpened(code, std::move(answer), probes, step.now);
  }
  // What is asked for once more was not done.
  if (asked_ == Kind::write && code != kChannelClosed && code != kRepeat) drift_.Forget();
  if (asked_ == Kind::link && step.task.kind != Task::Kind::probe) {
    return session_.TakePasswordRefused(std::move(answer), step.now);
  }
  if (code == kChannelClosed) return session_.TakeClosed(std::move(answer));
  if (code == kRepeat) return session_.TakeRepeat(std::move(answer));
  const bool refused = code == kNotAllowed || code == kLevelTooLow;
  if (refused || asked_ == Kind::trial) {
    session_.OnGood(step.now);
    return RowOf(asked_).refused(*this, step);
  }
  if (asked_ == Kind::serial && answer.outcome == Outcome::refused) {
    return session_.TakeNoSerial(std::move(answer));
  }
  if (step.task.kind == Task::Kind::background) archive_.OnFailure(step.now);
  return std::move(answer);
}

const MeterConversation::Row& MeterConversation::RowOf(Kind kind) {
  return *std::ranges::find(kRows, kind, &Row::kind);
}

bool MeterConversation::IsOwn(const Step& step) const {
  return step.task.kind == Task::Kind::poll && reads_.Reads(step.reply.pdu, step.task.query);
}

/// Data that something else needs first; a poll may read the same.
Answer MeterConversation::TakePrelude(Step& step) {
  switch (step.task.kind) {
    case Task::Kind::poll:
      return TakeRead(step);
    case Task::Kind::write:
      return AskAgain();
    case Task::Kind::probe:
      return std::move(step.reply.answer);
    case Task::Kind::background:
      if (asked_ == Kind::latch_time) return std::move(step.reply.answer);
      break;
    case Task::Kind::events:
      break;
  }
  if (identification_.trouble()) return identification_.OtherType();
  if (!reads_.ChooseIntegers()) return AskAgain();
  Answer answer;
  answer.then = Then::restart;
  return answer;
}

/// Data of a poll, or of a request before it.
Answer MeterConversation::TakeRead(Step& step) {
  Reply& reply = step.reply;
  if (AsksClock(reply.pdu)) AddDrift(step);
  if (reads_.ChooseIntegers()) return EndedBy(reply, Then::restart);
  if (asked_ == Kind::trial) return reads_.TakeTrial(std::move(reply.answer));
  if (IsOwn(step)) {
    // Readings of days and months are others now.
    if (identification_.TakeNewDay()) reply.answer.then = Then::restart;
    return std::move(reply.answer);
  }
  if (identification_.trouble()) return identification_.OtherType();
  if (reply.answer.then == Then::restart) return std::move(reply.answer);
  return EndedBy(reply, Then::ask_again);
}

/// The meter refuses a poll's own request.
Answer MeterConversation::ReadRefused(Step& step) {
  Reply& reply = step.reply;
  identification_.OnRefused(reply.pdu);
  if (Is(reply.pdu, AskLatchTime())) latched_.OnRefused();
  if (IsMasked(reply.pdu)) {
    reads_.OnMasksRefused();
    reply.answer.readings.clear();
    return EndedBy(reply, Then::replan);
  }
  if (IsFloatRead(reply.pdu) && identification_.WantType()) return AskAgain();
  reads_.OnRefused(step.task.query);
  return EndedBy(reply, Then::replan);
}

void MeterConversation::AddDrift(Step& step) {
  const Decoded drift = drift_.Of(step.reply.data, step.bytes, identification_.scale(), step.now);
  for (Reading& reading : step.reply.answer.readings) {
    const bool its =
        reading.point != kNoPoint && reads_.fields().DecoderOf(reading.point) == Decoder::drift;
    if (!its) continue;
    reading.value = drift.value;
    reading.quality = drift.quality;
  }
}

/// `request` need not be the latest: one that waits behind a probe may fail without having been
/// sent.
Then MeterConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                  Instant now) {
  const auto parts = SplitFrame(request.bytes, settings_.checksum);
  const View pdu = parts ? parts->body : View();
  const bool opens = !pdu.empty() && pdu[0] == kOpenChannel;
  const bool was_sent = outcome != Outcome::line_down && outcome != Outcome::busy;
  if (task.kind == Task::Kind::events && IsJournal(pdu)) archive_.OnNoRecord(outcome, now);
  if (was_sent) latched_.OnFailure(pdu);
  const bool of_latch = Is(pdu, AskLatchTime());
  if (task.kind == Task::Kind::background && !of_latch) archive_.OnFailure(now);
  session_.OnFailure(opens, outcome, now);
  if (was_sent && asked_ == Kind::trial && IsMasked(pdu)) {
    // Some are silent to what they do not know. It is asked as others are, and by that is there.
    reads_.EndTrial();
    return Then::ask_again;
  }
  identification_.OnLost();
  return Then::done;
}

Answer MeterConversation::Interpret(View request, View frame) {
  Reply reply = reader_.Read(request, frame);
  if (!reply.data.empty()) identification_.Learn(reply.pdu, reply.data);
  return std::move(reply.answer);
}

// ---------------------------------------------------------------- what is learned

config::Timing MeterConversation::LeastTimes(Duration character) const {
  const auto multiplier = static_cast<int>(identification_.multiplier());
  if (multiplier == 1) return {};
  return StretchedTimes(multiplier, character);
}

std::string MeterConversation::WhatIsLearned() const {
  const unsigned multiplier = identification_.multiplier();
  return Listed({reads_.Learned(), archive_.Learned(), latched_.Learned(),
                 multiplier > 1 ? "times by its multiplier " + std::to_string(multiplier) : ""});
}

}  // namespace baudgate::protocols::set4tm
