// The port of one line: when it is opened, lost and lent, and what is ended before it is given up.
// No thread and no clock: line_runner.h brings bytes, calls and the time. SettingsWatch watches the
// settings of the open port, and WriteGrace delays giving up the port until a write has ended.
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

// The settings of an open port. Those that a request needs are set before it goes out. Once a
// second, while the line works, the error counters of the driver are read, and it is checked
// whether another program has changed the settings. ModemManager, brltty, a getty and stty do that;
// each exchange would fail from then on, so the settings are set again.
class SettingsWatch {
 public:
  /// All outlive it. `listens`: a device of the line sends unasked, so the port is looked at even
  /// if nothing is sent.
  SettingsWatch(const config::Line& line, transports::Transport& port, PortDisplay& display,
                bool listens)
      : line_(line),
        port_(port),
        display_(display),
        listens_(listens && !line.is_network()),
        applied_(line.serial) {}

  void OnOpened(Now now);
  /// The port was lent, and has the settings of the line again.
  void OnReturned() { applied_ = line_.serial; }
  void OnClosed() { due_.reset(); }
  /// A request is about to be sent, with these settings.
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
  config::SerialSettings applied_;  // what the open port is set to
  Instant looked_{};
  std::optional<Instant> due_;
  std::uint64_t times_restored_ = 0;  // since the port was opened
};

// Delays giving up the port of a line until the write under way has ended, so that no password
// stays open in a device; a second at most.
class WriteGrace {
 public:
  static constexpr Duration kMost = 1s;

  /// `then` is called at the end; it replaces an earlier one.
  void Begin(std::function<void()> then, Instant now) {
    then_ = std::move(then);
    until_ = now + kMost;
  }
  bool waits() const { return until_.has_value(); }
  /// It waits, and its time is over.
  bool IsOver(Instant now) const { return until_ && *until_ <= now; }
  /// Only if it waits: calls what waits, now.
  void End() {
    until_.reset();
    std::exchange(then_, nullptr)();
  }
  /// Drops the call that waits.
  void CallOff() {
    until_.reset();
    then_ = nullptr;
  }
  const std::optional<Instant>& until() const { return until_; }

 private:
  std::function<void()> then_;
  std::optional<Instant> until_;
};

/// By `release --end`.
inline constexpr std::string_view kTakenBack = "the line was taken back";

/// One thread at a time, but is_open(). `now` never goes back.
class LinePort final : public bus::RequestPort, public PortLoan::Line {
 public:
  /// All references outlive it. `transport` is closed; what it tells its listener goes to the
  /// functions of the same names here. `retries` opens the port again after OnDown. `listens`: a
  /// device of the line speaks unasked, so the connection is wanted all the time.
  /// `transaction`: see TransactionBytes. `poller`, `telegrams` and `loan` may be made later.
  LinePort(const config::Line& line, bus::PointStore& store, transports::Transport& transport,
           transports::PortRetries& retries, records::LineRecorder& recorder,
           LineReporter& reporter, bus::Poller& poller, TelegramQueue& telegrams, PortLoan& loan,
           bool listens, std::size_t transaction);

  void Start(Now now);
  /// Closes the port, once the write under way has ended, and answers what is queued; then calls
  /// `stopped`, within a second. Nothing opens the port after that. `why`: "the gateway stops".
  void Stop(const std::string& why, Now now, std::function<void()> stopped);

  // From the transport.
  void OnOpened(Now now);
  void OnOpenFailed(const std::string& reason, transports::NoConnection why, Now now);
  void PassOn(View bytes, Now now);
  /// `takes_no_data`: see TransportListener::OnStuck.
  void OnLost(const std::string& reason, Now now, bool takes_no_data = false);
  void OnEnded(const std::string& reason, bool unread, Now now);

  // From the poller and the telegrams by hand.
  void Send(View bytes, const config::SerialSettings& serial, Now now) override;
  void DropUnsent() override;
  bool IsUnsent() const override { return resting_.is_unsent(); }

  // See PortLoan.
  std::optional<std::string> WhyNot() const override;
  bool Quiet() override;
  void OnLent(const std::string& text, WallTime until, Now now) override;
  void OnReturned(Now now) override;
  void OnPortFailed(const std::string& reason, Now now) override;

  /// See LineControl; the write under way ends first.
  void Release(Duration time, Now now);
  void EndRelease(Now now);

  /// To be called at Deadline(); earlier does nothing.
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;
  /// Behind every input of the line: the write under way may have ended.
  void Settle(Now now);

  bool is_open() const { return open_.load(); }  // from any thread

 private:
  // The connection.
  void DropLate();
  void Prove();
  void CheckConnection();
  /// How the port was lost, where more depends on it than a text.
  enum class Loss : std::uint8_t {
    port,
    unread,   ///< the server has dropped what it had not read
    silence,  ///< closed here, because no device behind it has answered
  };
  void Lost(const std::string& reason, Loss loss = Loss::port);
  void ClosePort();
  // The loan, and the stop.
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
  Now now_{};  // of the input that is being handled

  ConnectionProof proof_;
  RestingConnection resting_;
  std::atomic<bool> open_ = false;

  std::optional<Instant> lent_until_;  // to another program
  bool out_of_service_ = false;        // the points, since the port was lent
  WriteGrace grace_;
  std::optional<std::string> stopping_;  // why
};

}  // namespace baudgate::lines
