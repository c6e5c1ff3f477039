// The session of one meter: it is open once the meter has taken the password, and verified once the
// meter has told the right serial number. The conversation asks what the session needs before the
// request that a task is about:
//
//   > 05 01 30 30 30 30 30 30   open          < 05 00    open      < 05 03    password refused
//   > 05 08 00                  who is it?    < its serial number: verified, or another meter
//   any request                               < 05 05    the channel was closed: opened once more
//
// MeterMemory keeps what has to outlive a restart of the program.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/conversation.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

// What a meter's conversation keeps over restarts of the program: which meter it was, and how often
// the password was refused, for a meter blocks it for the day after three wrong ones
// (set-4tm protocol, 2.3). One line of text:
//
//   serial 12345678; password 5A refused 1790000000 1790003600      (the last in Unix seconds)
//
// 5A changes with the password, so that another one is tried again, and does not tell it.
class MeterMemory {
 public:
  /// From the first refusal to the one try more.
  static constexpr Duration kSecondTry = 1h;
  static constexpr std::size_t kMostTries = 2;

  explicit MeterMemory(View password);

  /// What text() said before the restart; empty: this is the first start.
  void Recall(std::string_view text, Now now);
  const std::string& text() const { return text_; }
  /// Recall was called: what is learned here has somewhere to stay.
  bool is_kept() const { return clock_.has_value(); }

  /// The meter that answered first; empty: none has said its number yet.
  std::optional<std::uint32_t> serial() const { return serial_; }
  void OnSerial(std::uint32_t serial);
  /// A person has accepted what is there: the next meter that answers is the right one, and the
  /// password is tried again.
  void OnEnabled();

  /// The password may be tried.
  bool MayTry(Instant now) const;
  void OnRefused(Instant now);
  void OnAccepted();
  /// It is not tried any more before OnEnabled.
  bool given_up() const { return refused_.size() >= kMostTries; }
  /// Until it may be tried again; of one that is given up, how long to leave the meter in peace.
  Duration Wait(Instant now) const;

 private:
  void Write();

  const std::uint8_t mark_;  // of the password
  std::optional<std::uint32_t> serial_;
  std::vector<Instant> refused_;  // when, at most kMostTries
  std::optional<Now> clock_;      // empty: civil time is not known, nothing is kept
  std::string text_;
};

class MeterSession {
 public:
  /// `settings` outlive it.
  explicit MeterSession(const Settings& settings);

  enum class Need : std::uint8_t {
    nothing,  ///< the task's own request may be sent
    link,     ///< the password must not be tried: the link test proves presence
    open,
    serial,
  };
  /// Opening proves presence as well: a link test (00) equals its own echo, so a `probe` opens.
  /// `wants_serial`: others need the serial number, though none is configured or remembered.
  Need NeedBefore(bool probe, bool wants_serial, Instant now) const;
  Bytes OpenPdu() const;
  /// The meter has taken the password since the last reconnect.
  bool accepted() const { return accepted_; }

  /// Since the start.
  bool has_answered() const { return last_good_ != Instant{}; }

  /// Data have come: the channel lives on.
  void OnGood(Instant now) { last_good_ = now; }
  /// A task has ended.
  void OnTaskEnd() {
    reopened_ = repeated_ = 0;
    doubted_.reset();
    doubts_ = 0;
  }
  /// A request was not answered; `opens`: it should have opened the channel.
  void OnFailure(bool opens, Outcome outcome, Instant now);
  void OnReconnect();
  /// Whoever answers is asked who it is, and gets the password.
  void OnEnabled();
  void Recall(std::string_view memory, Now now);
  const std::string& memory() const { return memory_.text(); }
  /// The password is refused, or another meter answers.
  const DeviceTrouble& trouble() const { return trouble_; }

  // Each of these takes a reply that matters to the session, and says how the task goes on.

  /// The status `code` answers OpenPdu.
  Answer TakeOpened(std::uint8_t code, Answer answer, bool probe, Instant now);
  /// A check value of one byte may fit a damaged reply: ask once more.
  bool Doubts(std::uint32_t serial);
  /// False: it is another meter's.
  bool TakeSerial(std::uint32_t serial);
  /// The answer to whatever another meter was asked.
  Answer OtherMeter() const;
  /// The meter does not tell its serial number.
  Answer TakeNoSerial(Answer answer);
  /// The same, where the request was also a poll's own: no other request follows.
  void AcceptUnnamed() { verified_ = true; }
  bool needs_number() const { return settings_.serial_number.has_value(); }
  Answer TakePasswordRefused(Answer answer, Instant now);
  Answer TakeClosed(Answer answer);
  /// Status 06: the meter wants the request once more.
  Answer TakeRepeat(Answer answer);

 private:
  std::string RefusedText() const;
  std::optional<std::uint32_t> Expected() const {
    return settings_.serial_number ? settings_.serial_number : memory_.serial();
  }

  const Settings& settings_;
  bool open_ = false;
  bool verified_ = false;
  bool accepted_ = false;
  Instant last_good_{};
  int reopened_ = 0;  // in the task under way
  int repeated_ = 0;
  std::optional<std::uint32_t> doubted_;
  int doubts_ = 0;
  // Kept over reconnects.
  MeterMemory memory_;
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::set4tm
