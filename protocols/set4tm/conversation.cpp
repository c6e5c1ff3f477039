// The session of a SET-4TM meter: channel, serial number, constants, then the queries of its
// points.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/conversation.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/set4tm/clock_drift.h"
#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/conversation_steps.h"
#include "protocols/set4tm/expect.h"
#include "protocols/set4tm/snapshot.h"

namespace baudgate::protocols::set4tm {
namespace {

/// The channel lives 20 s; with less than a quarter left it is opened anew (reference, 14.5).
constexpr Duration kChannelTrust = 15s;

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

}  // namespace

MeterConversation::MeterConversation(const config::Device& device, const Settings& settings,
                                     MeterBus& bus)
    : device_(device),
      settings_(settings),
      fields_(device.points),
      identification_(device, settings_),
      plan_(fields_.MakePlan(false)),
      line_latch_(bus.latch),
      journals_(device.events, static_cast<std::size_t>(settings_.journal_records)),
      loads_(settings_),
      billing_(settings_),
      address_(ParseAddress(device.address).value()),
      memory_(settings_.password) {
  OnReconnect();
}

void MeterConversation::OnReconnect() {
  identification_.OnReconnect();
  journals_.OnReconnect();
  drift_.Forget();
  latch_.Forget();
  for (BackgroundJob* one : jobs_) one->OnReconnect();
  integers_ = false;
  fields_.UseIntegers(false);
  open_ = verified_ = accepted_ = false;
  reopened_ = repeated_ = 0;
  UseMasks(settings_.snapshot == Snapshot::on);
  tries_masks_ = MasksMayHelp();
}

/// Only where they save requests.
bool MeterConversation::MasksMayHelp() const {
  if (masked_ || settings_.snapshot != Snapshot::automatic) return false;
  return fields_.MakePlan(true).queries().size() < plan_.queries().size();
}

void MeterConversation::UseMasks(bool masked) {
  masked_ = masked;
  tries_masks_ = false;
  plan_ = fields_.MakePlan(masked);
}

bool MeterConversation::ChooseIntegers() {
  const bool integers = identification_.floats() == Knows::no && !identification_.trouble();
  if (integers == integers_ || !(integers_ || fields_.HasFloats())) return false;
  integers_ = integers;
  fields_.UseIntegers(integers);
  UseMasks(!integers && settings_.snapshot == Snapshot::on);
  tries_masks_ = !integers && MasksMayHelp();
  return true;
}

std::optional<Bytes> MeterConversation::Trial(std::size_t query) const {
  if (!tries_masks_ || identification_.masked_floats() == Knows::no) return std::nullopt;
  if (!IsFloatRead(fields_.PduOf(plan_, query))) return std::nullopt;
  const std::size_t point = plan_.queries()[query].points.front();
  const PduPlan masked = fields_.MakePlan(true);
  for (std::size_t i = 0; i < masked.queries().size(); ++i) {
    if (std::ranges::count(masked.queries()[i].points, point) == 0) continue;
    Bytes pdu = fields_.PduOf(masked, i);
    return IsMasked(pdu) ? std::optional(std::move(pdu)) : std::nullopt;
  }
  return std::nullopt;
}

Request MeterConversation::Make(View pdu) const {
  Request request;
  request.bytes = MakeFrame(address_, pdu, settings_.checksum);
  request.expect = Expect(request.bytes, settings_);
  return request;
}

Result<Request> MeterConversation::Ask(const Task& task, Instant now) {
  const bool writes = task.kind == Task::Kind::write;
  const auto correction =
      writes ? CorrectionOf(task, now) : Result<Bytes>(Error{"nothing is to be written"});
  if (writes && !correction) return Error{correction.error()};
  if (LatchIsDue(task, now)) return MakeLatch();
  // Opening proves presence too: a link test (00) equals its own echo.
  if (task.kind == Task::Kind::probe || !open_ || now - last_good_ > kChannelTrust) {
    // Presence is proven without the password as well, if worse: its reply equals its echo.
    if (!memory_.MayTry(now)) return Make(kLinkOnly);
    Bytes open = {kOpenChannel};
    Append(open, settings_.password);
    Request request = Make(open);
    request.distinct = true;  // answered by a status; "00" answers nothing else
    // A meter that answers too late must not get a wrong password three times.
    request.expect.repeatable = accepted_;
    request.prepares = writes;
    return request;
  }
  const bool wants_serial =
      settings_.serial_number || memory_.is_kept() || journals_.has_events() || loads_.wanted();
  if (!verified_ && wants_serial) {
    Request request = Make(kAskSerial);
    request.prepares = writes;
    return request;
  }
  if (writes) return Make(*correction);
  if (task.kind == Task::Kind::events) {
    if (const auto question = identification_.Question({})) return Make(*question);
    return Make(journals_.Next(now));
  }
  if (AsksLatchTime(task, now)) {
    Request request = Make(AskLatchTime());
    request.stamped = true;
    return request;
  }
  if (task.kind == Task::Kind::background) return Make(NextInBackground(now));
  const auto trial = Trial(task.query);
  Bytes pdu = trial ? *trial : fields_.PduOf(plan_, task.query);
  if (const auto question = identification_.Question(fields_.Matches(pdu))) return Make(*question);
  // The meter repeats the id: a late reply to the masked read before this one is found out.
  if (IsMasked(pdu)) pdu[2] = ++mask_id_;
  Request request = Make(pdu);
  request.stamped = AsksClock(pdu);
  if (request.stamped) drift_.OnAsked();
  if (trial) request.expect.repeatable = false;
  return request;
}

void MeterConversation::Stamp(Request& request, Now arrives, Duration character) {
  const auto asked = SplitFrame(request.bytes, settings_.checksum);
  if (AsksClock(asked->body)) {
    drift_.OnSent(arrives, character);
  } else {
    line_latch_.OnClock(arrives);
  }
}

Result<Bytes> MeterConversation::CorrectionOf(const Task& task, Instant now) const {
  if (device_.points[task.point].write != kCorrectsClock) {
    return Error{"SET-4TM meters are read only here"};
  }
  return ClockCorrection(task.value, drift_, now);
}

void MeterConversation::AddDrift(Reply& reply, std::size_t bytes, Instant now) {
  const Decoded drift = drift_.Of(reply.data, bytes, identification_.scale(), now);
  for (Reading& reading : reply.answer.readings) {
    const bool its =
        reading.point != kNoPoint && fields_.DecoderOf(reading.point) == Decoder::drift;
    if (!its) continue;
    reading.value = drift.value;
    reading.quality = drift.quality;
  }
}

Answer MeterConversation::End(Answer answer) {
  reopened_ = repeated_ = 0;
  return answer;
}

Answer MeterConversation::OnFrame(const Task& task, const Request& request, View frame,
                                  Instant now) {
  Reply reply = Decode(request.bytes, frame);
  if (reply.pdu.empty()) return End(std::move(reply.answer));
  if (reply.status) return AfterStatus(task, std::move(reply), now);
  last_good_ = now;
  identification_.Learn(reply.pdu, reply.data);
  if (Is(reply.pdu, kAskSerial) && !Verify(ByteReader(reply.data).U32Be(0).value_or(0))) {
    return End(Swapped());
  }
  if (ReadsLatched(reply.pdu)) TakeLatched(reply);
  if (task.kind == Task::Kind::events) return AfterJournal(std::move(reply), now);
  if (task.kind == Task::Kind::background) return AfterBackground(std::move(reply), now);
  if (task.kind == Task::Kind::write) return AskAgain();
  if (task.kind != Task::Kind::poll) return End(std::move(reply.answer));
  if (AsksClock(reply.pdu)) AddDrift(reply, frame.size(), now);
  if (ChooseIntegers()) {
    reply.answer.then = Then::restart;
    return End(std::move(reply.answer));
  }
  if (tries_masks_ && IsMasked(reply.pdu)) return AfterTrial(std::move(reply.answer));
  const Bytes wanted = fields_.PduOf(plan_, task.query);
  if (Is(reply.pdu, wanted) || (IsMasked(reply.pdu) && IsMasked(wanted))) {
    // Readings of days and months are others now.
    if (identification_.TakeNewDay()) reply.answer.then = Then::restart;
    return End(std::move(reply.answer));
  }
  if (identification_.trouble()) return End(OtherType());
  if (reply.answer.then == Then::restart) return End(std::move(reply.answer));
  reply.answer.then = Then::ask_again;
  return std::move(reply.answer);
}

/// Steps of the session before it are the poll's as well.
Answer MeterConversation::AfterJournal(Reply reply, Instant now) {
  if (!IsJournal(reply.pdu)) {
    if (identification_.trouble()) return End(OtherType());
    Answer answer = AskAgain();
    if (!ChooseIntegers()) return answer;
    answer.then = Then::restart;
    return End(std::move(answer));
  }
  const JournalReader reader{settings_.time_zone, identification_.KnowsStatusWord()};
  return End(kept_.With(KeptTexts::kJournals, journals_.OnRecord(reply.data, reader, now)));
}

/// What it does not give so, it may give by 08 1B.
Answer MeterConversation::AfterTrial(Answer answer) {
  const bool whole = std::ranges::all_of(
      answer.readings, [](const Reading& reading) { return IsGood(reading.quality); });
  tries_masks_ = false;
  if (!whole) return AskAgain();
  UseMasks(true);
  answer.then = Then::restart;
  return End(std::move(answer));
}

/// Whoever answers is asked who it is, and gets the password.
void MeterConversation::OnEnabled() {
  memory_.OnEnabled();
  verified_ = false;
}

void MeterConversation::Recall(std::string_view memory, Now now) {
  memory_.Recall(memory, now);
  if (memory_.given_up()) trouble_ = {Reason::password_refused, RefusedText()};
}

Then MeterConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                  Instant now) {
  const auto asked = SplitFrame(request.bytes, settings_.checksum);
  const bool opening = asked && asked->body[0] == kOpenChannel;
  if (opening) open_ = false;
  // It has refused before, and has answered something now: that counts, or each query would try.
  if (opening && outcome == Outcome::unexpected && trouble_.reason == Reason::password_refused) {
    memory_.OnRefused(now);
  }
  if (task.kind == Task::Kind::events && asked && IsJournal(asked->body)) {
    journals_.OnFailure(outcome, now);
  }
  const bool was_sent = outcome != Outcome::line_down && outcome != Outcome::busy;
  const bool of_latch = asked && Is(asked->body, AskLatchTime());
  if (was_sent) latch_.Doubt();
  if (of_latch && was_sent) latch_.OnFailure(line_latch_.number());
  if (task.kind == Task::Kind::background && !of_latch) job().OnFailure(now);
  verified_ = false;
  reopened_ = repeated_ = 0;
  if (was_sent && asked && task.kind == Task::Kind::poll && tries_masks_ && IsMasked(asked->body)) {
    // Some are silent to what they do not know. It is asked as others are, and by that is there.
    tries_masks_ = false;
    return Then::ask_again;
  }
  identification_.OnLost();
  return Then::done;
}

bool MeterConversation::ForgetRefusals() {
  tries_masks_ = MasksMayHelp();
  identification_.ForgetRefusals();
  journals_.ForgetRefusals();
  latch_.ForgetRefusals();
  return plan_.ForgetRefusals();
}

config::Timing MeterConversation::LeastTimes(Duration character) const {
  const auto multiplier = static_cast<int>(identification_.multiplier());
  if (multiplier == 1) return {};
  return StretchedTimes(multiplier, character);
}

std::string MeterConversation::WhatIsLearned() const {
  std::string text;
  const auto say = [&text](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  if (masked_) say("floats together (08 23)");
  if (integers_) say("integers in place of floats, which its type does not have");
  if (device_.events && journals_.has_refused()) say("no journals: it refuses them");
  for (const BackgroundJob* one : jobs_) {
    const std::string shown = one->Shown();
    if (!shown.empty()) say(shown);
  }
  if (latch_.refused()) say("does not tell when it latched: its latched values are not served");
  if (latch_.Missed(line_latch_.number())) {
    say("has not heard the latest latch: its latched values are not served");
  }
  if (identification_.multiplier() > 1) {
    say("times by its multiplier " + std::to_string(identification_.multiplier()));
  }
  return text;
}

}  // namespace baudgate::protocols::set4tm
