// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/replies.h"

#include <algorithm>
#include <utility>

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/conversation_steps.h"
#include "protocols/set4tm/snapshot.h"
#include "protocols/set4tm/status.h"

namespace baudgate::protocols::set4tm {
namespace {

Answer EndedBy(Reply& reply, Then then) {
  reply.answer.then = then;
  return std::move(reply.answer);
}

}  // namespace

/// What follows from a reply, by the kind of its request. Statuses that mean the same for every
/// request (channel closed, repeat, busy) are taken before (Take).
struct MeterReplies::Row {
  RequestKind kind;
  Answer (*data)(MeterReplies& its, Step& step);
  Answer (*refused)(MeterReplies& its, Step& step);  ///< status 01 or 03
};

const MeterReplies::Row MeterReplies::kRows[] = {
    // > 05 08 00     < 05 00 89 A2 61 …: verified before the table     < 05 01: it does not tell
    {RequestKind::serial, [](auto& its, Step& step) { return its.TakePrelude(step); },
     [](auto& its, Step& step) {
       if (!its.IsOwn(step) || its.parts_.session.needs_number()) {
         return its.parts_.session.TakeNoSerial(std::move(step.reply.answer));
       }
       its.parts_.session.AcceptUnnamed();
       return its.ReadRefused(step);
     }},
    // > 05 08 12     < 05 10 40 10 …: learned before the table         < 05 01: options may give it
    {RequestKind::question, [](auto& its, Step& step) { return its.TakePrelude(step); },
     [](auto& its, Step& step) {
       its.parts_.identification.OnRefused(step.reply.pdu);
       return its.IsOwn(step) ? its.ReadRefused(step) : AskAgain();
     }},
    // > 05 08 14 50  < 05 00 00 12 …: compared before the table        < 05 01: it never tells
    {RequestKind::latch_time, [](auto& its, Step& step) { return its.TakePrelude(step); },
     [](auto& its, Step& step) {
       its.parts_.latched.OnRefused();
       if (step.task.kind == Task::Kind::background) return std::move(step.reply.answer);
       return its.IsOwn(step) ? its.ReadRefused(step) : AskAgain();
     }},
    // > 05 04 01 00  < 05 31 30 15 …: events                           < 05 01: no such record
    {RequestKind::record,
     [](auto& its, Step& step) {
       // A task reads several records: each may open the channel anew.
       its.parts_.session.OnTaskEnd();
       return its.parts_.archive.TakeRecord(step.reply.data, step.now);
     },
     [](auto& its, Step& step) {
       its.parts_.session.OnTaskEnd();
       return its.parts_.archive.TakeNoRecord(std::move(step.reply.answer), step.now);
     }},
    // > 05 06 03 06 58 18  < 05 14 14 08 …: records                    < 05 01: no such profile
    {RequestKind::background,
     [](auto& its, Step& step) {
       return its.parts_.archive.TakeInBackground(step.reply.data, step.now);
     },
     [](auto& its, Step& step) {
       return its.parts_.archive.TakeRefusal(std::move(step.reply.answer), step.now);
     }},
    // > 05 08 23 01 00 …   < 05 01 …: by mask from now on              < 05 01: by 08 1B
    {RequestKind::trial, [](auto& its, Step& step) { return its.TakeRead(step); },
     [](auto& its, Step&) {
       its.parts_.reads.EndTrial();
       return AskAgain();
     }},
    // > 05 08 1B 00 11     < 05 00 00 5C 43: readings                  < 05 01: not these points
    {RequestKind::read, [](auto& its, Step& step) { return its.TakeRead(step); },
     [](auto& its, Step& step) { return its.ReadRefused(step); }},
    // > 05 03 0B 00 0A     answered by a status                        < 05 01: not corrected
    {RequestKind::write, Plain, Plain},
    // > 05 00, > 05 01 30 30 30 30 30 30, > FE 03 08 …: data never answer them
    {RequestKind::link, Plain, Plain},
    {RequestKind::open, Plain, Plain},
    {RequestKind::latch, Plain, Plain},
};

/// The reply means what it says, and nothing else follows.
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
  // What is asked for once more was not done.
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

/// Handles a poll that ends with an answer that has no values, to the read or to a step before it
/// (the opening of the channel is refused). The points are asked again sooner than with the next
/// turn of their group, which may be tomorrow.
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

/// Data that something else needs first; a poll may read the same.
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

/// Data of a poll, or of a request before it.
Answer MeterReplies::TakeRead(Step& step) {
  Reply& reply = step.reply;
  if (AsksClock(reply.pdu)) AddDrift(step);
  if (parts_.reads.ChooseIntegers()) return EndedBy(reply, Then::restart);
  if (step.asked == RequestKind::trial) return parts_.reads.TakeTrial(std::move(reply.answer));
  if (IsOwn(step)) {
    // Readings of days and months are others now.
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

/// The meter refuses a poll's own request.
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

}  // namespace baudgate::protocols::set4tm
