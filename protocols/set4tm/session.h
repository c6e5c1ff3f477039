// MeterSession is the session with one meter. It is open once the meter has accepted the password,
// and verified once the meter has returned the expected serial number. Before the request of a
// task, the conversation sends what the session needs:
//
//   > 05 01 30 30 30 30 30 30   open            < 05 00    open      < 05 03    password refused
//   > 05 08 00                  ask the number  < serial number: verified, or another meter
//   any request                                 < 05 05    the channel was closed: open it again
//
// MeterMemory stores what must survive a restart of the program.
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
// 5A is the mark of the password (MarkOf in protocols/set4tm/session.cpp). A new password almost
// always has another mark, and is then tried at once. The mark does not reveal the password.
class MeterMemory {
 public:
  /// Time from the first refusal of the password to the second and last try.
  static constexpr Duration kSecondTry = 1h;
  static constexpr std::size_t kMostTries = 2;

  explicit MeterMemory(View password);

  /// Restores the state. `text`: the result of text() before the restart; empty on the first start.
  void Recall(std::string_view text, Now now);
  const std::string& text() const { return text_; }
  /// True if Recall was called: the program then stores text() over restarts.
  bool is_kept() const { return clock_.has_value(); }

  /// Returns the serial number of the meter that has answered first, since OnEnabled or the first
  /// start of the program. Empty: no meter has answered yet.
  std::optional<std::uint32_t> serial() const { return serial_; }
  void OnSerial(std::uint32_t serial);
  /// Call it when a person has accepted the connected meter: the next meter that answers becomes
  /// the expected one, and the password is tried again.
  void OnEnabled();

  bool MayTry(Instant now) const;
  void OnRefused(Instant now);
  void OnAccepted();
  /// True if the password was refused so often that it is not tried again before OnEnabled.
  bool given_up() const { return refused_.size() >= kMostTries; }
  /// Returns the time until the next try of the password. If given_up(), returns how long the meter
  /// gets no request at all.
  Duration Wait(Instant now) const;

 private:
  void Write();

  const std::uint8_t mark_;  // see MarkOf
  std::optional<std::uint32_t> serial_;
  std::vector<Instant> refused_;
  std::optional<Now> clock_;  // empty: Recall was not called, so nothing is stored
  std::string text_;
};

class MeterSession {
 public:
  explicit MeterSession(const Settings& settings);

  enum class Need : std::uint8_t {
    nothing,
    /// A link test, which proves that the meter is present when the password must not be tried.
    link,
    open,
    serial,
  };
  /// Returns what must be sent before the request of a task. For a `probe` this is an opening of
  /// the channel if the password may be tried: its reply proves that the meter is present, but the
  /// reply to a link test (00) equals its echo. `wants_serial`: true if the serial number is needed
  /// even if none is configured or stored.
  Need NeedBefore(bool probe, bool wants_serial, Instant now) const;
  Bytes OpenPdu() const;
  /// True if the meter has accepted the password since the last reconnect.
  bool accepted() const { return accepted_; }

  /// True if the meter has answered since the start of the program.
  bool has_answered() const { return last_good_ != Instant{}; }

  /// Call it after each reply with data: the meter keeps the channel open for another 20 s.
  void OnGood(Instant now) { last_good_ = now; }
  void OnTaskEnd() {
    reopened_ = repeated_ = 0;
    doubted_.reset();
    doubts_ = 0;
  }
  void OnFailure(bool opens, Outcome outcome, Instant now);
  void OnReconnect();
  /// Accepts the connected meter as the expected one and lets the password be tried again.
  void OnEnabled();
  void Recall(std::string_view memory, Now now);
  const std::string& memory() const { return memory_.text(); }
  /// Returns the trouble of the meter: the password is refused, or another meter answers.
  const DeviceTrouble& trouble() const { return trouble_; }

  /// Takes the status `code` in the reply to OpenPdu.
  Answer TakeOpened(std::uint8_t code, Answer answer, bool probe, Instant now);
  /// True if the serial number must be asked again, because a damaged reply with a KS can look
  /// correct. A number other than the expected one is believed when it comes twice, or after
  /// kDoubts questions.
  bool Doubts(std::uint32_t serial);
  /// Takes the serial number of the meter. Returns false if it is not the expected meter.
  bool TakeSerial(std::uint32_t serial);
  /// Returns the answer to any request as long as another meter is connected.
  Answer OtherMeter() const;
  Answer TakeNoSerial(Answer answer);
  /// Accepts the meter without a serial number. Call it if a poll has read the number for a point,
  /// the meter refuses it, and none is configured.
  void AcceptUnnamed() { verified_ = true; }
  bool needs_number() const { return settings_.serial_number.has_value(); }
  Answer TakePasswordRefused(Answer answer, Instant now);
  Answer TakeClosed(Answer answer);
  /// Takes status 06, with which the meter requests a repetition.
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
  // Counts and the latest serial number of the task under way.
  int reopened_ = 0;
  int repeated_ = 0;
  std::optional<std::uint32_t> doubted_;
  int doubts_ = 0;
  // memory_ and trouble_ keep their values over reconnects.
  MeterMemory memory_;
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::set4tm
