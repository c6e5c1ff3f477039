// MeterSession is the session with one meter. It is open once the meter has accepted the password,
// and verified once the meter has returned the expected serial number. The conversation asks what
// the session needs before the request of a task:
//
//   > 05 01 30 30 30 30 30 30   open            < 05 00    open      < 05 03    password refused
//   > 05 08 00                  ask the number  < serial number: verified, or another meter
//   any request                                 < 05 05    the channel was closed: open it again
//
// MeterMemory stores what must survive a restart of the program.
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

// MeterMemory stores over restarts of the program which meter has answered, and when the password
// was refused: a meter blocks its password for the rest of the day after three wrong ones (set-4tm
// protocol, 2.3). The stored text is one line:
//
//   serial 12345678; password 5A refused 1790000000 1790003600      (times in Unix seconds)
//
// 5A is a mark of the password. It changes with the password, so that a new password is tried
// again, but does not reveal it.
class MeterMemory {
 public:
  /// Time from the first refusal to the second and last try.
  static constexpr Duration kSecondTry = 1h;
  static constexpr std::size_t kMostTries = 2;

  explicit MeterMemory(View password);

  /// `text`: the text() from before the restart; empty on the first start.
  void Recall(std::string_view text, Now now);
  const std::string& text() const { return text_; }
  /// True if Recall was called, so that the text is stored.
  bool is_kept() const { return clock_.has_value(); }

  /// The serial number of the meter that answered first. Empty: none is known yet.
  std::optional<std::uint32_t> serial() const { return serial_; }
  void OnSerial(std::uint32_t serial);
  /// A person has accepted the connected meter: it becomes the expected one, and the password is
  /// tried again.
  void OnEnabled();

  bool MayTry(Instant now) const;
  void OnRefused(Instant now);
  void OnAccepted();
  /// True if the password is not tried any more before OnEnabled.
  bool given_up() const { return refused_.size() >= kMostTries; }
  /// Returns the time until the next try, or for how long not to ask the meter if given_up().
  Duration Wait(Instant now) const;

 private:
  void Write();

  const std::uint8_t mark_;  // see MarkOf
  std::optional<std::uint32_t> serial_;
  std::vector<Instant> refused_;  // times of refusals, at most kMostTries
  std::optional<Now> clock_;      // empty: the civil time is unknown, so nothing is stored
  std::string text_;
};

class MeterSession {
 public:
  /// `settings` must outlive this object.
  explicit MeterSession(const Settings& settings);

  enum class Need : std::uint8_t {
    nothing,
    link,  ///< the password must not be tried, so a link test proves presence
    open,
    serial,
  };
  /// Returns what must be sent before the task's request. A `probe` opens the channel to prove
  /// presence, because the reply to a link test (00) equals its echo. `wants_serial`: another part
  /// needs the serial number, even if none is configured or stored.
  Need NeedBefore(bool probe, bool wants_serial, Instant now) const;
  Bytes OpenPdu() const;
  /// True if the meter has accepted the password since the last reconnect.
  bool accepted() const { return accepted_; }

  /// True if the meter has answered since the start of the program.
  bool has_answered() const { return last_good_ != Instant{}; }

  /// Call after each reply with data: the meter keeps the channel open for another 20 s.
  void OnGood(Instant now) { last_good_ = now; }
  void OnTaskEnd() {
    reopened_ = repeated_ = 0;
    doubted_.reset();
    doubts_ = 0;
  }
  /// Call if a request was not answered. `opens`: the request was to open the channel.
  void OnFailure(bool opens, Outcome outcome, Instant now);
  void OnReconnect();
  /// Accepts the connected meter as the expected one and lets the password be tried again.
  void OnEnabled();
  void Recall(std::string_view memory, Now now);
  const std::string& memory() const { return memory_.text(); }
  /// Set if the password is refused, or another meter answers.
  const DeviceTrouble& trouble() const { return trouble_; }

  // Each of these functions takes a reply and returns how the task continues.

  /// Takes the status `code` in the reply to OpenPdu.
  Answer TakeOpened(std::uint8_t code, Answer answer, bool probe, Instant now);
  /// True if the serial number must be asked again: with a KS a damaged reply may look correct.
  bool Doubts(std::uint32_t serial);
  /// Returns false if `serial` belongs to another meter.
  bool TakeSerial(std::uint32_t serial);
  /// Returns the answer to any request while another meter is connected.
  Answer OtherMeter() const;
  Answer TakeNoSerial(Answer answer);
  /// Takes the same refusal if a poll has asked for the number itself.
  void AcceptUnnamed() { verified_ = true; }
  bool needs_number() const { return settings_.serial_number.has_value(); }
  Answer TakePasswordRefused(Answer answer, Instant now);
  Answer TakeClosed(Answer answer);
  /// Takes status 06: the meter wants the request again.
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
  int reopened_ = 0;  // in the task under way, as the next three
  int repeated_ = 0;
  std::optional<std::uint32_t> doubted_;
  int doubts_ = 0;
  // The rest stays over reconnects.
  MeterMemory memory_;
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::set4tm
