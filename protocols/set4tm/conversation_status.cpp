// What follows when a meter answers with a status alone, or is not the one that should answer.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/conversation_steps.h"
#include "protocols/set4tm/snapshot.h"
#include "protocols/set4tm/status.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr int kReopens = 1;
constexpr int kRepeats = 1;

}  // namespace

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

/// It does not tell its serial number. Where one is configured its values may be another meter's;
/// elsewhere that contradicts nothing.
Answer MeterConversation::AfterNoSerial(Answer answer) {
  if (!settings_.serial_number) {
    verified_ = true;
    return AskAgain();
  }
  answer.outcome = Outcome::refused;
  answer.readings.clear();
  answer.wait = std::max<Duration>(answer.wait, 1min);
  return End(std::move(answer));
}

Answer MeterConversation::AfterStatus(const Task& task, Reply reply, Instant now) {
  if (reply.pdu[0] == kOpenChannel) return AfterOpen(task, std::move(reply), now);
  const auto code = CodeOf(*reply.status);
  // What is asked for once more was not done.
  if (reply.pdu[0] == kWrite && code != kChannelClosed && code != kRepeat) drift_.Forget();
  if (reply.pdu[0] == kLinkTest && task.kind != Task::Kind::probe) {
    return PasswordRefused(std::move(reply.answer), now);
  }
  const bool trial = tries_masks_ && IsMasked(reply.pdu);
  const bool asks_serial = !verified_ && Is(reply.pdu, kAskSerial);
  switch (code) {
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
      if (asks_serial && reply.answer.outcome == Outcome::refused) {
        return AfterNoSerial(std::move(reply.answer));
      }
      if (task.kind == Task::Kind::background) job().OnFailure(now);
      if (!trial) return End(std::move(reply.answer));
  }
  last_good_ = now;
  if (trial) {
    tries_masks_ = false;
    return AskAgain();
  }
  if (task.kind == Task::Kind::events && IsJournal(reply.pdu)) {
    return End(kept_.With(KeptTexts::kJournals, journals_.OnRefused(std::move(reply.answer), now)));
  }
  if (task.kind == Task::Kind::background && Is(reply.pdu, asked_in_background_)) {
    return End(job().OnRefused(std::move(reply.answer), now));
  }
  const bool own = task.kind == Task::Kind::poll;
  const bool asked_for = own && Is(reply.pdu, fields_.PduOf(plan_, task.query));
  if (asks_serial && !(asked_for && !settings_.serial_number)) {
    return AfterNoSerial(std::move(reply.answer));
  }
  const bool of_latch = Is(reply.pdu, AskLatchTime());
  if (of_latch) latch_.OnRefused();
  if (of_latch && task.kind == Task::Kind::background) return End(std::move(reply.answer));
  const bool question = identification_.OnRefused(reply.pdu) || of_latch;
  if (own && IsMasked(reply.pdu)) {
    // Older firmware: go back to 08 1B, the points are not to blame.
    UseMasks(false);
    reply.answer.readings.clear();
  } else if (own && IsFloatRead(reply.pdu) && identification_.WantType()) {
    return AskAgain();
  } else if (asked_for) {
    if (asks_serial) verified_ = true;
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

}  // namespace baudgate::protocols::set4tm
