// What one line does with its port: when a connection has proven itself or is made anew, how long
// the port is lent, what is ended before it is given up. Joins the poller, the flight recorder and
// the status of the line. No thread and no clock: line_runner.h brings bytes, calls and the time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "config/model/line.h"
#include "gateway/daemon/hand_desk.h"
#include "gateway/daemon/news_desk.h"
#include "gateway/daemon/port_loan.h"
#include "gateway/daemon/rest.h"
#include "gateway/poll/poller.h"
#include "gateway/requests/commands.h"
#include "gateway/requests/routed.h"
#include "gateway/state/device_memory.h"
#include "gateway/store/point_store.h"
#include "gateway/trace/line_recorder.h"
#include "transports/port_keeper.h"
#include "transports/transport.h"

namespace baudgate {

/// One thread at a time, but recorder() and is_open(). `now` never goes back.
class LineDriver final : private PollerListener, private PortLoan::Line {
 public:
  /// All references outlive the driver. `port` is closed; what it tells its listener goes to the
  /// functions of the same names here. `retries` opens the port again after OnDown. Without
  /// `memory` what conversations learn ends with the program; without `events` devices are asked
  /// for them no more than once.
  LineDriver(const config::Line& line, std::uint32_t first_device, const Poller::FindProtocol& find,
             PointStore& store, Transport& port, PortRetries& retries,
             LineRecorder::Sink recordings, DeviceMemory* memory = nullptr,
             EventSink* events = nullptr, const LoanRecords& loans = {});

  void Start(Now now);
  /// Closes the port, once the write under way has ended, and answers what is queued; then calls
  /// `stopped`, within a second. Nothing opens the port after that.
  void Stop(Now now, std::function<void()> stopped);

  // From the transport.
  void OnOpened(Now now);
  void OnOpenFailed(const std::string& reason, Now now);
  void OnBytes(View bytes, Now now);
  void OnLost(const std::string& reason, Now now);
  void OnEnded(const std::string& reason, Now now);
  void OnRoom() { loan_.OnRoom(); }

  // From the servers of its port: see PortOwner and PortLoan.
  void Want(serial_server::PortUser& user, const serial_server::Visit& visit, Now now);
  void Return(serial_server::PortUser& user, const serial_server::Visit& visit,
              const std::string& why, Now now);
  /// Its server ends.
  void Dismiss(serial_server::PortUser& user, const std::string& why, Now now);
  PortLoan& loan() { return loan_; }

  /// To be called at Deadline(); earlier does nothing.
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;

  // See Poller.
  void Submit(WriteCommand command, Now now);
  void Submit(RoutedRequest request, Now now);
  void Forget(std::uint64_t client, Now now);
  void SetInUse(std::uint32_t device, bool in_use, Now now);
  /// `reported`: it is what OnEvents has told last. Otherwise the store of events has opened, and
  /// this is what it holds.
  void OnEventsKept(std::uint32_t device, const std::string& said, bool reported, Now now);
  /// See Conversation.
  void OnHostClock(bool right) { poller_.OnHostClock(right); }

  /// See LineControl; the write under way ends first.
  void Release(Duration time, Now now);
  void TakeBack(Now now);

  LineRecorder& recorder() { return recorder_; }  // any thread may read it
  bool is_open() const { return open_.load(); }   // from any thread

 private:
  /// The present connection, or between two the last one.
  enum class Connection : std::uint8_t {
    fresh,    ///< nothing has come yet
    heard,    ///< bytes have come, which may be the greeting of a server that is in use
    proven,   ///< it has worked; a local port does so by opening
    useless,  ///< it ended before it was proven
  };

  void Send(View bytes, const config::SerialSettings& serial) override;
  void OnNoReply() override {
    rest_.GiveUpHeld();
    port_.DropUnsent();
  }
  void OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                     const std::string& reason) override;
  void OnWarning(std::uint32_t device, const std::string& message) override;
  void OnMemory(std::uint32_t device, const std::string& memory) override {
    if (memory_ != nullptr) memory_->Set(device, memory);
  }
  void OnEvents(ReportedEvents events) override {
    reported_.insert(events.device);
    if (events_ != nullptr) events_->OnReported(std::move(events));
  }
  void OnDrained(std::uint32_t device, Instant asked) override {
    if (events_ != nullptr) events_->OnDrained(device, asked);
  }
  void OnNews(News news) override { news_.Tell(std::move(news), now_); }
  void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) override {
    if (events_ != nullptr) events_->OnRead(device, points, at);
  }

  // See PortLoan.
  std::string WhyNot() const override;
  bool Quiet(Now now) override;
  void OnLent(const std::string& text, WallTime until, Now now) override;
  void OnReturned(Now now) override;
  void OnPortFailed(const std::string& reason, Now now) override;

  void Recall();
  void Announce();
  std::uint64_t Answers() const;
  void Prove();
  void CheckConnection();
  void Lost(const std::string& reason);
  void Down(const std::string& reason);
  void ClosePort();
  void AfterTheWrite(std::function<void()> then);
  void GoOn();
  void Lend(Duration time);
  void EndLoan();
  void ShowPort(LineStatus::Port port, const std::string& text, WallTime released_until = {});
  void LookAtPort();
  void CheckSettings();
  void CountErrors();
  void Settle();

  const config::Line& config_;
  const std::uint32_t first_device_;
  PointStore& store_;
  const std::uint32_t line_;  // in the store
  Transport& port_;
  PortRetries& retries_;
  LineRecorder recorder_;
  DeviceMemory* const memory_;  // null: there is none
  EventSink* const events_;     // null: nothing is kept
  NewsDesk news_;
  std::set<std::uint32_t> reported_;  // devices whose events are not kept yet
  Poller poller_;
  config::SerialSettings hand_serial_;  // of the telegram by hand that was sent last
  HandDesk hand_;
  PortLoan loan_;
  Now now_{};                                        // of the input that is being handled
  std::optional<Instant> check_at_;                  // of a network connection
  std::optional<Instant> lent_until_;                // the port, to another program
  std::optional<Instant> patience_until_;            // with the write under way
  std::function<void()> after_write_;                // what waits for the end of that write
  const config::SerialSettings* applied_ = nullptr;  // what the open port is set to
  Connection connection_ = Connection::fresh;
  bool announced_ = false;  // in the log: this connection
  Rest rest_;
  const bool listens_;  // a device of it speaks unasked: the connection is wanted all the time
  Instant opened_{};
  std::string shown_;            // of the port, in the status
  bool out_of_service_ = false;  // the points, since the port was lent
  bool stopping_ = false;
  Instant errors_counted_{};
  std::optional<Instant> look_at_;  // at the settings of a port to which nothing is sent
  std::uint64_t times_restored_ = 0;
  std::atomic<bool> open_ = false;
};

}  // namespace baudgate
