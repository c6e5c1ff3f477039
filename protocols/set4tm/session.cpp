// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/status.h"

namespace baudgate::protocols::set4tm {
namespace {

using Seconds = std::chrono::seconds;

/// Returns a mark of the password, 0…250, which is stored to detect a new password. A new password
/// most likely has another mark, but many passwords share each mark, so the mark does not reveal
/// the password.
std::uint8_t MarkOf(View password) { return static_cast<std::uint8_t>(Crc16(password) % 251); }

std::vector<std::string_view> Words(std::string_view text) {
  std::vector<std::string_view> words;
  while (!(text = Trim(text)).empty()) {
    const auto end = std::min(text.find(' '), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

}  // namespace

MeterMemory::MeterMemory(View password) : mark_(MarkOf(password)) {}

void MeterMemory::Recall(std::string_view text, Now now) {
  clock_ = now;
  while (!text.empty()) {
    const auto end = std::min(text.find(';'), text.size());
    const auto words = Words(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.size() == 2 && words[0] == "serial") {
      serial_ = ParseInteger<std::uint32_t>(words[1]);
    } else if (words.size() > 3 && words[0] == "password" && words[2] == "refused") {
      if (ParseInteger<unsigned>(words[1], 16) != mark_) continue;
      for (std::size_t i = 3; i < words.size() && !given_up(); ++i) {
        const auto at = ParseInteger<std::int64_t>(words[i]);
        if (!at) continue;
        // After the clock was set back, the stored time can be in the future: the refusal then
        // counts as one of now.
        const auto ago = now.wall - WallTime(Seconds(*at));
        refused_.push_back(now.instant - std::max<Duration>(ago, {}));
      }
    }
  }
  Write();
}

void MeterMemory::OnSerial(std::uint32_t serial) {
  serial_ = serial;
  Write();
}

void MeterMemory::OnEnabled() {
  serial_.reset();
  refused_.clear();
  Write();
}

bool MeterMemory::MayTry(Instant now) const {
  return refused_.empty() || (!given_up() && now - refused_.front() >= kSecondTry);
}

void MeterMemory::OnRefused(Instant now) {
  if (!given_up()) refused_.push_back(now);
  Write();
}

void MeterMemory::OnAccepted() {
  refused_.clear();
  Write();
}

Duration MeterMemory::Wait(Instant now) const {
  if (refused_.empty() || given_up()) return kSecondTry;
  return std::max<Duration>(refused_.front() + kSecondTry - now, {});
}

void MeterMemory::Write() {
  if (!clock_) return;
  text_ = serial_ ? fmt::format("serial {}", *serial_) : std::string();
  if (refused_.empty()) return;
  text_ += fmt::format("{}password {:02X} refused", text_.empty() ? "" : "; ", mark_);
  for (const Instant at : refused_) {
    const WallTime wall = clock_->wall + (at - clock_->instant);
    text_ +=
        fmt::format(" {}", std::chrono::duration_cast<Seconds>(wall.time_since_epoch()).count());
  }
}

namespace {

/// How long the channel counts as open after the latest good reply. The meter keeps it open for 20
/// s, so it is opened again when a quarter of the 20 s is left (reference, 14.5).
constexpr Duration kChannelTrust = 15s;
/// The maximum number of repeated openings (kReopens) and of repeated requests (kRepeats) in one
/// task.
constexpr int kReopens = 1;
constexpr int kRepeats = 1;
/// The maximum number of questions for the serial number until two equal replies come.
constexpr int kDoubts = 3;
constexpr Duration kWrongMeter = 1min;

}  // namespace

MeterSession::MeterSession(const Settings& settings)
    : settings_(settings), memory_(settings.password) {}

MeterSession::Need MeterSession::NeedBefore(bool probe, bool wants_serial, Instant now) const {
  if (probe || !open_ || now - last_good_ > kChannelTrust) {
    return memory_.MayTry(now) ? Need::open : Need::link;
  }
  const bool serial = settings_.serial_number || memory_.is_kept() || wants_serial;
  return serial && !verified_ ? Need::serial : Need::nothing;
}

Bytes MeterSession::OpenPdu() const {
  Bytes pdu = {kOpenChannel};
  Append(pdu, settings_.password);
  return pdu;
}

void MeterSession::OnFailure(bool opens, Outcome outcome, Instant now) {
  if (opens) open_ = false;
  // If an odd reply comes when the channel is opened after a refusal, it counts as another refusal.
  // Otherwise each query would try the password again.
  if (opens && outcome == Outcome::unexpected && trouble_.reason == Reason::password_refused) {
    memory_.OnRefused(now);
  }
  verified_ = false;
  OnTaskEnd();
}

void MeterSession::OnReconnect() {
  open_ = verified_ = accepted_ = false;
  OnTaskEnd();
}

void MeterSession::OnEnabled() {
  memory_.OnEnabled();
  verified_ = false;
}

void MeterSession::Recall(std::string_view memory, Now now) {
  memory_.Recall(memory, now);
  if (memory_.given_up()) trouble_ = {Reason::password_refused, RefusedText()};
}

Answer MeterSession::TakeOpened(std::uint8_t code, Answer answer, bool probe, Instant now) {
  open_ = code == kOk;
  if (!open_) {
    return code == kLevelTooLow ? TakePasswordRefused(std::move(answer), now) : std::move(answer);
  }
  accepted_ = true;
  memory_.OnAccepted();
  if (trouble_.reason == Reason::password_refused) trouble_ = {};
  last_good_ = now;
  verified_ = false;  // another meter may have got the address, so the serial number is asked again
  if (!probe) answer.then = Then::ask_again;
  return answer;
}

bool MeterSession::Doubts(std::uint32_t serial) {
  if (settings_.checksum == Checksum::crc || serial == Expected()) return false;
  const bool again = std::exchange(doubted_, serial) == serial;
  return !again && doubts_++ < kDoubts;
}

/// Takes the serial number of the meter that answers. The expected meter is the configured one,
/// else the first that answered since OnEnabled.
bool MeterSession::TakeSerial(std::uint32_t serial) {
  const auto expected = Expected();
  if (!expected) memory_.OnSerial(serial);
  verified_ = serial == expected.value_or(serial);
  if (verified_) {
    if (trouble_.reason == Reason::swapped) trouble_ = {};
    return true;
  }
  trouble_ = {
      Reason::swapped,
      "meter " + std::to_string(serial) + " answers instead of " + std::to_string(*expected) +
          (settings_.serial_number
               ? "; correct `serial_number` or the address"
               : "; if the meter was replaced on purpose, accept it with 'baudgate enable'")};
  return false;
}

Answer MeterSession::OtherMeter() const { return NotThisMeter(kWrongMeter, trouble_.text); }

/// Takes a reply without a serial number. If a number is configured, the values may belong to
/// another meter, so they are rejected.
Answer MeterSession::TakeNoSerial(Answer answer) {
  if (!settings_.serial_number) {
    verified_ = true;
    return AskAgain();
  }
  answer.outcome = Outcome::refused;
  answer.readings.clear();
  answer.wait = std::max<Duration>(answer.wait, kWrongMeter);
  return answer;
}

std::string MeterSession::RefusedText() const {
  return std::string("the meter refuses the password; correct `password`, which is ") +
         (memory_.given_up() ? "tried again only after 'baudgate enable'" : "tried again in 1 h");
}

Answer MeterSession::TakePasswordRefused(Answer answer, Instant now) {
  if (memory_.MayTry(now)) memory_.OnRefused(now);
  answer.wait = memory_.Wait(now);
  answer.outcome = Outcome::refused;
  answer.reason = RefusedText();
  trouble_ = {Reason::password_refused, answer.reason};
  return answer;
}

Answer MeterSession::TakeClosed(Answer answer) {
  open_ = false;
  if (reopened_ >= kReopens) return answer;
  ++reopened_;
  return AskAgain();
}

Answer MeterSession::TakeRepeat(Answer answer) {
  if (repeated_ >= kRepeats) return answer;
  ++repeated_;
  return AskAgain();
}

}  // namespace baudgate::protocols::set4tm
