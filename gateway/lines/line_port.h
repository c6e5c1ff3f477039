// `LinePort` is the port of one line: it opens, lends and closes the port. Before it lends or
// closes the port, it ends the current write. It has no thread and no clock:
// gateway/lines/line_runner.h passes bytes, calls and the time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "config/model/line.h"
#include "gateway/base/time.h"
#include "gateway/bus/poller/poller.h"
#include "gateway/lines/line_reporter.h"
#include "gateway/lines/port_loan.h"
#include "gateway/lines/server_connection.h"
#include "gateway/lines/telegram_queue.h"
#include "gateway/records/trace/line_recorder.h"
#include "transports/port_keeper.h"
#include "transports/transport.h"

namespace baudgate::lines {

// SettingsWatch sets the settings that a request needs before the request is sent. At most once a
// second, while the line works, it also reads the error counters of the driver and checks whether
// another program (ModemManager, brltty, a getty, stty) has changed the settings of the port. If
// so, it restores them, because each exchange would fail.
class SettingsWatch {
 public:
  /// The references must outlive this object. `listens`: a device of the line sends without a
  /// request, so a local port is checked once a second even if the gateway sends nothing.
  SettingsWatch(const config::Line& line, transports::Transport& port, PortDisplay& display,
                bool listens)
      : line_(line),
        port_(port),
        display_(display),
        listens_(listens && !line.is_network()),
        applied_(line.serial) {}

  void OnOpened(Now now);
  /// Called when a loan of the port is over and the port has the settings of the line again.
  void OnReturned() { applied_ = line_.serial; }
  void OnClosed() { due_.reset(); }
  /// Must be called before a request is sent that needs the settings `serial`.
  void OnSend(const config::SerialSettings& serial, Now now);
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const { return due_; }

 private:
  void Look(Now now);
  void CountErrors();
  void CheckSettings(Now now);

  const config::Line& line_;
  transports::Transport& port_;
  PortDisplay& display_;
  const bool listens_;
  config::SerialSettings applied_;
  Instant looked_{};
  std::optional<Instant> due_;
  // How often the settings were set again since the port was opened.
  std::uint64_t times_restored_ = 0;
};

// Delays closing the port of a line until the current write has ended, at most a second. Otherwise
// a device that the write has unlocked with its password would stay unlocked.
class WriteGrace {
 public:
  static constexpr Duration kMost = 1s;

  /// `then` is called when the current write has ended, or kMost after `now`; it is not called
  /// after CallOff. It replaces the `then` of an earlier Begin.
  void Begin(std::function<void()> then, Instant now) {
    then_ = std::move(then);
    until_ = now + kMost;
  }
  bool waits() const { return until_.has_value(); }
  bool IsOver(Instant now) const { return until_ && *until_ <= now; }
  /// Calls `then` now. Must be called only if waits().
  void End() {
    until_.reset();
    std::exchange(then_, nullptr)();
  }
  void CallOff() {
    until_.reset();
    then_ = nullptr;
  }
  const std::optional<Instant>& until() const { return until_; }

 private:
  std::function<void()> then_;
  std::optional<Instant> until_;
};

/// The reason that log and records give when `baudgate release --end` takes the port back.
inline constexpr std::string_view kTakenBack = "'baudgate release --end' has ended the loan";

/// The port of one line. Not thread-safe, except is_open(). `now` must never go back.
class LinePort final : public bus::RequestPort, public PortLoan::Line {
 public:
  /// The references must outlive this object. `poller`, `telegrams` and `loan` may be constructed
  /// later. `transport` must be closed; its listener must pass each event to OnOpened … OnEnded
  /// below. `retries` opens the port again after OnDown. `listens`: a device of the line sends
  /// without a request, so the connection must be open all the time. `transaction`: see
  /// TransactionBytes (protocols/protocol.h).
  LinePort(const config::Line& line, bus::PointStore& store, transports::Transport& transport,
           transports::PortRetries& retries, records::LineRecorder& recorder,
           LineReporter& reporter, bus::Poller& poller, TelegramQueue& telegrams, PortLoan& loan,
           bool listens, std::size_t transaction);

  void Start(Now now);
  /// Ends the current write, answers queued telegrams, closes the port, and calls `stopped`, all
  /// within a second. The port is not opened again. `why` is for users: "the gateway stops".
  void Stop(const std::string& why, Now now, std::function<void()> stopped);

  // The listener of the transport calls these functions.
  void OnOpened(Now now);
  void OnOpenFailed(const std::string& reason, transports::NoConnection why, Now now);
  void PassOn(View bytes, Now now);
  /// `takes_no_data`: the transport has closed the port because the port accepted no more data.
  void OnLost(const std::string& reason, Now now, bool takes_no_data = false);
  void OnEnded(const std::string& reason, bool unread, Now now);

  // The poller and the queue of telegrams by hand call these functions.
  void Send(View bytes, const config::SerialSettings& serial, Now now) override;
  void DropUnsent() override;
  bool IsUnsent() const override { return resting_.is_unsent(); }

  // PortLoan calls these functions; see PortLoan::Line.
  std::optional<std::string> WhyNot() const override;
  bool Quiet() override;
  void OnLent(const std::string& text, WallTime until, Now now) override;
  void OnReturned(Now now) override;
  void OnPortFailed(const std::string& reason, Now now) override;

  /// See LineControl::Release. The port is lent only after the current write has ended.
  void Release(Duration time, Now now);
  void EndRelease(Now now);

  /// Must be called at Deadline(). An earlier call does nothing.
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;
  /// Continues Release or Stop if the write has ended. To be called after every input of the line.
  void Settle(Now now);

  bool is_open() const { return open_.load(); }

 private:
  void DropLate();
  void Prove();
  void CheckConnection();
  /// The cause of the loss of a port: it decides the hint in the log and the text in the status.
  enum class Loss : std::uint8_t {
    port,
    unread,   ///< the server dropped a request that it had not read
    silence,  ///< this gateway has closed the port, because no device behind it has answered
  };
  void Lost(const std::string& reason, Loss loss = Loss::port);
  void ClosePort();
  void AfterTheWrite(std::function<void()> then);
  void Lend(Duration time);
  void EndLoan();

  const config::Line& line_;
  transports::Transport& transport_;
  transports::PortRetries& retries_;
  bus::Poller& poller_;
  TelegramQueue& telegrams_;
  PortLoan& loan_;
  PortDisplay display_;
  SettingsWatch settings_;
  Now now_{};  // time of the input that is being handled

  ConnectionProof proof_;
  RestingConnection resting_;
  std::atomic<bool> open_ = false;

  std::optional<Instant> lent_until_;  // end of the loan to another program
  bool out_of_service_ = false;        // the points are out of service, because the port is lent
  WriteGrace grace_;
  std::optional<std::string> stopping_;
};

}  // namespace baudgate::lines
