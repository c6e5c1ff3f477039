// The session of a SET-4TM meter: channel, serial number, constants, then the queries of its
// points.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/conversation.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/expect.h"
#include "protocols/set4tm/snapshot.h"
#include "protocols/set4tm/status.h"

namespace baudgate::protocols::set4tm {
namespace {

/// The channel lives 20 s; with less than a quarter left it is opened anew (reference, 14.5).
constexpr Duration kChannelTrust = 15s;
constexpr int kReopens = 1;
constexpr int kRepeats = 1;

const Bytes kLinkOnly = {kLinkTest};
const Bytes kAskSerial = {kRead, kSerialNumber};

bool IsFloatRead(View pdu) { return pdu.size() == 4 && pdu[0] == kRead && pdu[1] == kFloats; }

bool IsJournal(View pdu) { return pdu[0] == kJournal || pdu[0] == kJournalExtended; }

bool Is(View pdu, const Bytes& other) { return std::ranges::equal(pdu, other); }

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

/// A step of the session that is nobody's news.
Answer AskAgain() {
  Answer answer;
  answer.then = Then::ask_again;
  return answer;
}

}  // namespace

MeterConversation::MeterConversation(const config::Device& device)
    : device_(device),
      settings_(ReadSettings(device.options)),
      fields_(device.points),
      identification_(device, settings_),
      plan_(fields_.MakePlan(false)),
      journals_(device.events, static_cast<std::size_t>(settings_.journal_records)),
      address_(ParseAddress(device.address).value()),
      memory_(settings_.password) {
  OnReconnect();
}

void MeterConversation::OnReconnect() {
  identification_.OnReconnect();
  journals_.OnReconnect();
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
  request.expect = Expect(request.bytes, device_.options);
  return request;
}

Result<Request> MeterConversation::Ask(const Task& task, Instant now) {
  if (task.kind == Task::Kind::write) return Error{"SET-4TM meters are read only here"};
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
    return request;
  }
  const bool wants_serial = settings_.serial_number || memory_.is_kept() || journals_.has_events();
  if (!verified_ && wants_serial) return Make(kAskSerial);
  if (task.kind == Task::Kind::events) {
    if (const auto question = identification_.Question({})) return Make(*question);
    return Make(journals_.Next(now));
  }
  const auto trial = Trial(task.query);
  Bytes pdu = trial ? *trial : fields_.PduOf(plan_, task.query);
  if (const auto question = identification_.Question(fields_.Matches(pdu))) return Make(*question);
  // The meter repeats the id: a late reply to the masked read before this one is found out.
  if (IsMasked(pdu)) pdu[2] = ++mask_id_;
  Request request = Make(pdu);
  if (trial) request.expect.repeatable = false;
  return request;
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
  if (task.kind == Task::Kind::events) return AfterJournal(std::move(reply), now);
  if (task.kind != Task::Kind::poll) return End(std::move(reply.answer));
  if (ChooseIntegers()) {
    reply.answer.then = Then::replan;
    return End(std::move(reply.answer));
  }
  if (tries_masks_ && IsMasked(reply.pdu)) return AfterTrial(std::move(reply.answer));
  const Bytes wanted = fields_.PduOf(plan_, task.query);
  if (Is(reply.pdu, wanted) || (IsMasked(reply.pdu) && IsMasked(wanted))) {
    // Readings of days and months are others now.
    if (identification_.TakeNewDay()) reply.answer.then = Then::replan;
    return End(std::move(reply.answer));
  }
  if (identification_.trouble()) return End(OtherType());
  reply.answer.then = Then::ask_again;
  return std::move(reply.answer);
}

/// Steps of the session before it are the poll's as well.
Answer MeterConversation::AfterJournal(Reply reply, Instant now) {
  if (!IsJournal(reply.pdu)) {
    if (identification_.trouble()) return End(OtherType());
    Answer answer = AskAgain();
    if (!ChooseIntegers()) return answer;
    answer.then = Then::replan;
    return End(std::move(answer));
  }
  const JournalReader reader{settings_.time_zone, identification_.KnowsStatusWord()};
  return End(journals_.OnRecord(reply.data, reader, now));
}

/// What it does not give so, it may give by 08 1B.
Answer MeterConversation::AfterTrial(Answer answer) {
  const bool whole = std::ranges::all_of(
      answer.readings, [](const Reading& reading) { return IsGood(reading.quality); });
  tries_masks_ = false;
  if (!whole) return AskAgain();
  UseMasks(true);
  answer.then = Then::replan;
  return End(std::move(answer));
}

/// Nothing of it is good: it is asked for its type alone, until that is right.
Answer MeterConversation::OtherType() {
  Answer answer;
  answer.outcome = Outcome::refused;
  answer.wait = 1min;
  answer.reason = identification_.trouble().text;
  return answer;
}

/// The meter that is configured, else the first that has answered since a person enabled it.
bool MeterConversation::Verify(std::uint32_t serial) {
  const auto expected = settings_.serial_number ? settings_.serial_number : memory_.serial();
  if (!expected) memory_.OnSerial(serial);
  verified_ = serial == expected.value_or(serial);
  if (verified_) {
    journals_.OnMeter(serial);
    if (trouble_.reason == Reason::swapped) trouble_ = {};
    return true;
  }
  trouble_ = {Reason::swapped,
              "meter " + std::to_string(serial) + " answers in place of " +
                  std::to_string(*expected) +
                  (settings_.serial_number
                       ? "; correct `serial_number` or the address"
                       : "; if it was replaced on purpose, 'baudgate enable' takes it")};
  return false;
}

Answer MeterConversation::Swapped() const {
  Answer answer;
  answer.outcome = Outcome::refused;
  answer.wait = 1min;
  answer.reason = trouble_.text;
  return answer;
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

std::string MeterConversation::RefusedText() const {
  return std::string("the meter refuses the password; set `password`; ") +
         (memory_.given_up() ? "it is not tried again before 'baudgate enable'"
                             : "tried again in 1 h");
}

Answer MeterConversation::PasswordRefused(Answer answer, Instant now) {
  if (memory_.MayTry(now)) memory_.OnRefused(now);
  answer.wait = memory_.Wait(now);
  answer.outcome = Outcome::refused;
  answer.reason = RefusedText();
  trouble_ = {Reason::password_refused, answer.reason};
  return answer;
}

Answer MeterConversation::AfterOpen(const Task& task, Reply reply, Instant now) {
  open_ = CodeOf(*reply.status) == kOk;
  if (!open_) {
    const bool refused = CodeOf(*reply.status) == kLevelTooLow;
    return End(refused ? PasswordRefused(std::move(reply.answer), now) : std::move(reply.answer));
  }
  accepted_ = true;
  memory_.OnAccepted();
  if (trouble_.reason == Reason::password_refused) trouble_ = {};
  last_good_ = now;
  verified_ = false;  // another meter may have taken the address
  if (task.kind == Task::Kind::probe) return End(std::move(reply.answer));
  reply.answer.then = Then::ask_again;
  return std::move(reply.answer);
}

Answer MeterConversation::AfterClosed(Answer answer) {
  open_ = false;
  if (reopened_ >= kReopens) return End(std::move(answer));
  ++reopened_;
  return AskAgain();
}

Answer MeterConversation::AfterStatus(const Task& task, Reply reply, Instant now) {
  if (reply.pdu[0] == kOpenChannel) return AfterOpen(task, std::move(reply), now);
  if (reply.pdu[0] == kLinkTest && task.kind != Task::Kind::probe) {
    return PasswordRefused(std::move(reply.answer), now);
  }
  const bool trial = tries_masks_ && IsMasked(reply.pdu);
  switch (CodeOf(*reply.status)) {
    case kChannelClosed:
      return AfterClosed(std::move(reply.answer));
    case kRepeat:
      if (repeated_ >= kRepeats) return End(std::move(reply.answer));
      ++repeated_;
      return AskAgain();
    case kNotAllowed:
    case kLevelTooLow:
      break;
    default:
      if (!trial) return End(std::move(reply.answer));
  }
  last_good_ = now;
  if (trial) {
    tries_masks_ = false;
    return AskAgain();
  }
  if (task.kind == Task::Kind::events && IsJournal(reply.pdu)) {
    return End(journals_.OnRefused(std::move(reply.answer), now));
  }
  const bool own = task.kind == Task::Kind::poll;
  if (Is(reply.pdu, kAskSerial) && !settings_.serial_number && task.kind != Task::Kind::probe) {
    verified_ = true;  // it does not tell, which contradicts nothing
    return AskAgain();
  }
  const bool question = identification_.OnRefused(reply.pdu);
  if (own && IsMasked(reply.pdu)) {
    // Older firmware: go back to 08 1B, the points are not to blame.
    UseMasks(false);
    reply.answer.readings.clear();
  } else if (own && IsFloatRead(reply.pdu) && identification_.WantType()) {
    return AskAgain();
  } else if (own && Is(reply.pdu, fields_.PduOf(plan_, task.query))) {
    plan_.OnRefused(task.query);
  } else if (question) {
    // Only the values that need it suffer; the options can give what the meter does not.
    return AskAgain();
  } else {
    return End(std::move(reply.answer));
  }
  reply.answer.then = Then::replan;
  return End(std::move(reply.answer));
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
  verified_ = false;
  reopened_ = repeated_ = 0;
  const bool was_sent = outcome != Outcome::line_down && outcome != Outcome::busy;
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
  return plan_.ForgetRefusals();
}

config::Timing MeterConversation::LeastTimes(Duration character) const {
  const auto multiplier = static_cast<int>(identification_.multiplier());
  if (multiplier == 1) return {};
  return StretchedTimes(multiplier, character);
}

std::string MeterConversation::WhatIsLearned() const {
  std::string text = masked_ ? "floats together (08 23)" : "";
  if (integers_) text = "integers in place of floats, which its type does not have";
  if (device_.events && journals_.has_refused()) {
    text += (text.empty() ? "" : ", ") + std::string("no journals: it refuses them");
  }
  if (identification_.multiplier() > 1) {
    text += (text.empty() ? "" : ", ") + std::string("times by its multiplier ") +
            std::to_string(identification_.multiplier());
  }
  return text;
}

}  // namespace baudgate::protocols::set4tm
