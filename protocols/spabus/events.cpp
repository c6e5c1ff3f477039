// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/events.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr std::size_t kSecondDigits = 2;
constexpr std::size_t kMillisecondDigits = 3;
constexpr std::uint32_t kSecondsInMinute = 60;

bool IsLetter(char c) { return c >= 'A' && c <= 'Z'; }

/// Takes a time such as "12.345" from the front of `text`. It has exactly three decimals, so a
/// channel can follow without a space.
std::optional<SaidTime> TakeTime(std::string_view& text) {
  std::string_view rest = text;
  const auto seconds = TakeNumber(rest, kSecondDigits);
  if (!seconds || *seconds >= kSecondsInMinute || rest.size() <= kMillisecondDigits) return {};
  const std::string_view decimals = rest.substr(1, kMillisecondDigits);
  if (rest.front() != '.' || !std::ranges::all_of(decimals, IsDigit)) return std::nullopt;
  const auto milliseconds = ParseInteger<std::int64_t>(decimals);
  text = Trim(rest.substr(1 + kMillisecondDigits));
  return SaidTime{std::chrono::seconds(*seconds) + std::chrono::milliseconds(*milliseconds), 1min};
}

DeviceEvent ParseEvent(std::string_view part) {
  DeviceEvent event;
  std::string_view rest = Trim(part);
  event.time = TakeTime(rest);
  if (!rest.empty() && IsDigit(rest.front())) {
    event.channel = TakeNumber(rest, kChannelDigits).value_or(0);
  }
  if (!rest.empty() && rest.front() == 'E') {
    rest.remove_prefix(1);
    const auto code = TakeNumber(rest, kNumberDigits);
    const bool ends = rest.empty() || rest.front() == ' ';
    if (event.time && code && *code > 0 && ends) {
      event.code = *code;
      event.text = std::string(Trim(rest));
      return event;
    }
  }
  event.channel = 0;
  event.text = std::string(Trim(part));
  return event;
}

bool LooksLikeEvent(std::string_view part) {
  const std::string_view text = Trim(part);
  if (text.empty() || !IsDigit(text.front())) return false;
  for (std::size_t i = 1; i + 1 < text.size(); ++i) {
    if (IsLetter(text[i]) && IsDigit(text[i + 1])) return true;
  }
  return false;
}

}  // namespace

std::vector<DeviceEvent> ParseEvents(std::string_view data) {
  std::vector<DeviceEvent> events;
  if (Trim(data).empty()) return events;
  for (const std::string_view part : Split(data, '/')) events.push_back(ParseEvent(part));
  return events;
}

bool LooksLikeEvents(std::string_view data) {
  return Trim(data).empty() || std::ranges::all_of(Split(data, '/'), LooksLikeEvent);
}

std::string PrintEvent(const DeviceEvent& event) {
  const Duration time = event.time.value_or(SaidTime{}).time;
  const auto padded = [](std::int64_t number, std::size_t digits) {
    const std::string text = std::to_string(number);
    return std::string(digits - std::min(digits, text.size()), '0') + text;
  };
  return padded(time / 1s % kSecondsInMinute, kSecondDigits) + "." +
         padded(time / 1ms % 1000, kMillisecondDigits) + " " + std::to_string(event.channel) + "E" +
         std::to_string(event.code) + (event.text.empty() ? "" : " " + event.text);
}

namespace {

constexpr Address kEvents{0, 'L', std::nullopt};
constexpr Address kBackup{0, 'B', std::nullopt};
constexpr Address kStatus{0, 'C', std::nullopt};
/// A relay that ignores B in this many tasks in a row counts as a relay that does not support B,
/// unless it has answered B since the program started.
constexpr int kSilentBackups = 3;
/// A relay that refuses L this often in a row counts as a relay that does not support L, unless it
/// has answered L since the port was opened: an apparent refusal can be a damaged reply, or a reply
/// of another device.
constexpr int kMostRefusals = 3;
/// After this many failed requests in a row the status of the device has a remark.
constexpr int kManyFailures = 10;
/// Within this time two different events cannot have the same text, because an event contains the
/// second of its minute.
constexpr Duration kNeverTwiceWithin = 50s;

Answer GoOn() {
  Answer answer;
  answer.then = Then::ask_again;
  return answer;
}

}  // namespace

Command EventSession::Next(unsigned slave) {
  if (owes_backup_) {
    step_ = Step::backup;
    return ReadOf(slave, kBackup, 0);
  }
  if (clears_) {
    step_ = Step::clear;
    return WriteOf(slave, kStatus, "0");
  }
  step_ = owes_status_ ? Step::status : Step::events;
  return ReadOf(slave, owes_status_ ? kStatus : kEvents, 0);
}

Command EventSession::Instead(unsigned slave) {
  owes_backup_ = true;
  return Next(slave);
}

Answer EventSession::OnAnswer(Exchange exchange, Instant now) {
  const Step step = std::exchange(step_, Step::none);
  failures_ = 0;
  if (exchange.answer.outcome != Outcome::ok) return OnRefused(step, std::move(exchange), now);
  switch (step) {
    case Step::backup:
      owes_backup_ = false;
      silent_backups_ = 0;
      answers_backup_ = true;
      return OnEvents(std::move(exchange), true, now);
    case Step::events:
      refusals_ = 0;
      answers_ = true;
      return OnEvents(std::move(exchange), false, now);
    case Step::status:
      return OnStatus(exchange, now);
    case Step::clear:
    case Step::none:
      break;
  }
  clears_ = false;
  exchange.answer.then = Then::replan;
  return std::move(exchange.answer);
}

Answer EventSession::OnEvents(Exchange exchange, bool again, Instant now) {
  EventBatch batch;
  batch.events = ParseEvents(exchange.data);
  batch.said = std::move(exchange.data);
  batch.again = again;
  if (batch.events.empty()) {
    if (again && held_ && held_->said != last_) return ReportHeld(now);
    if (again) {
      // B is empty, so the reply to L, if it is held, was a late copy of the latest batch.
      held_.reset();
      return GoOn();
    }
    batch.drained = true;
    Answer answer;
    answer.batch = std::move(batch);
    return answer;
  }
  if (!again) {
    const bool repeats = batch.said == last_ && now - last_at_ < kNeverTwiceWithin;
    if (knows_backup_ && (rechecks_ || repeats)) return Hold(std::move(batch.said), false);
  } else if (held_ && held_->said == batch.said) {
    return ReportHeld(now);
  } else if (held_ && rechecks_) {
    // The two readings of the batch differ, so one of them is damaged, and B is repeated. The task
    // ends here, so that other tasks get their turn if the readings differ again and again.
    Answer answer = Hold(std::move(batch.said), true);
    answer.then = Then::done;
    return answer;
  } else if (rechecks_) {
    return Hold(std::move(batch.said), true);
  }
  return Report(std::move(batch), now);
}

Answer EventSession::Hold(std::string said, bool again) {
  held_ = {std::move(said), again};
  owes_backup_ = true;
  return GoOn();
}

Answer EventSession::ReportHeld(Instant now) {
  EventBatch batch;
  batch.events = ParseEvents(held_->said);
  batch.said = held_->said;
  batch.again = held_->again;
  return Report(std::move(batch), now);
}

Answer EventSession::Report(EventBatch batch, Instant now) {
  held_.reset();
  last_ = batch.said;
  last_at_ = now;
  const auto breaks_history = [](const DeviceEvent& event) {
    return event.code == kRestarted || event.code == kOverflow;
  };
  owes_status_ = owes_status_ || std::ranges::any_of(batch.events, breaks_history);
  Answer answer;
  answer.batch = std::move(batch);
  return answer;
}

/// Handles the reply to C, the status of the relay: 1 the relay was restarted, 2 events were lost,
/// 3 both.
Answer EventSession::OnStatus(const Exchange& exchange, Instant now) {
  owes_status_ = false;
  const auto status = ParseInteger<int>(Trim(exchange.data));
  clears_ = status && *status != 0;
  return held_ ? ReportHeld(now) : GoOn();
}

/// Handles a refusal. If B or C is refused, the task goes on without this request. A relay that
/// does not support L (kMostRefusals) is not asked for events again.
Answer EventSession::OnRefused(Step step, Exchange exchange, Instant now) {
  Answer answer = std::move(exchange.answer);
  answer.readings.clear();
  const bool judged = exchange.nack && RuleOf(*exchange.nack).judged;
  if (!judged || answer.outcome == Outcome::busy) return answer;
  if (step == Step::events) {
    if (answer.outcome == Outcome::unsupported) ++refusals_;
    if (!has_events()) answer.then = Then::replan;
    return answer;
  }
  (step == Step::backup ? owes_backup_ : owes_status_) = false;
  if (step == Step::backup) knows_backup_ = false;
  clears_ = false;
  return held_ ? ReportHeld(now) : GoOn();
}

bool EventSession::has_events() const { return wanted_ && (answers_ || refusals_ < kMostRefusals); }

const DeviceTrouble& EventSession::remark() const {
  static const DeviceTrouble kNone;
  static const DeviceTrouble kRefused{Reason::none,
                                      "it sends no events, because it refuses the request L"};
  static const DeviceTrouble kFailed{
      Reason::none, "its events cannot be read: there is no good reply to the requests L and B"};
  if (refusals_ >= kMostRefusals) return kRefused;
  return failures_ >= kManyFailures ? kFailed : kNone;
}

Then EventSession::OnFailure(Outcome outcome) {
  const Step step = std::exchange(step_, Step::none);
  if (outcome == Outcome::busy) return Then::done;  // the request was not sent
  ++failures_;
  if (step == Step::events || step == Step::none) owes_backup_ = true;
  if (step == Step::status || step == Step::clear) owes_status_ = clears_ = false;
  const bool silent = step == Step::backup && outcome == Outcome::no_reply;
  silent_backups_ = silent ? silent_backups_ + 1 : 0;
  if (silent_backups_ >= kSilentBackups && !answers_backup_) {
    owes_backup_ = knows_backup_ = false;
    owes_status_ = true;  // OnStatus then reports the batch in held_
  }
  return Then::done;
}

void EventSession::OnReconnect() {
  answers_ = clears_ = false;
  owes_backup_ = owes_status_ = knows_backup_ = true;
  held_.reset();
  refusals_ = failures_ = silent_backups_ = 0;
  step_ = Step::none;
}

}  // namespace baudgate::protocols::spabus
