// Runs one line for real on an event loop that it may share with other lines: joins a transport and
// the clocks with the parts of the line, which hold the rules. On a shared loop
// nothing here blocks; a local serial port, whose driver may, gets a loop of its own (lines.h).
// LineParts holds the parts, LineServers serves the port over the network, and LineSlot is the
// place of a line, which stays over reloads although the line may go.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/guarded.h"
#include "gateway/bus/poller/poller.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/lines/line_port.h"
#include "gateway/lines/line_reporter.h"
#include "gateway/lines/port_loan.h"
#include "gateway/lines/serial_server/server.h"
#include "gateway/lines/telegram_queue.h"
#include "gateway/records/disk/device_memory.h"
#include "gateway/records/trace/line_recorder.h"

namespace baudgate::lines {

// All that belongs to one line, joined: its poller, its port, telegrams by hand, the loan of its
// port, the flight recorder, and the reporter. No thread and no clock: LineRunner brings bytes,
// calls and the time, and calls Settle after each of them.

/// One thread at a time, except where a part says otherwise. `now` never goes back.
class LineParts {
 public:
  /// What a line needs of the gateway.
  struct Links {
    records::LineRecorder::Sink recordings{};
    records::DeviceMemory* memory =
        nullptr;                       ///< null: what conversations learn ends with the program
    bus::EventSink* events = nullptr;  ///< null: devices are asked for events no more than once
    LoanRecords loans{};
    std::vector<protocols::ForeignRule> foreign{};  ///< of all protocols
  };

  /// All references outlive it. See LinePort.
  LineParts(const config::Line& line, std::uint32_t first_device,
            const bus::Poller::FindProtocol& find, bus::PointStore& store,
            transports::Transport& transport, transports::PortRetries& retries, Links links);

  /// Conversations know what they had learned; the port opens.
  void Start(Now now);
  /// The caller keeps to Poller::kQueueLimit (CommandRoom), so the poller has room for it.
  void Submit(bus::WriteCommand command, Now now);
  /// See EventPath::Kept.
  void OnEventsKept(std::uint32_t device, const std::string& said, bool reported, Now now);
  /// To be called at Deadline(); earlier does nothing.
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;
  /// After every input.
  void Settle(Now now);

 private:
  const config::Line& line_;
  const std::uint32_t first_device_;
  records::DeviceMemory* const memory_;

 public:
  records::LineRecorder recorder;
  LineReporter reporter;
  bus::Poller poller;
  TelegramQueue telegrams;
  LinePort port;
  PortLoan loan;
};

// The servers for the port of one line: the configured one, and one by hand for a while
// (`baudgate release --tcp`). On the loop of the line.
class LineServers {
 public:
  /// All outlive it. `owner`: of the port; clients ask it for `loan`.
  LineServers(asio::io_context& io, const config::Line& line, serial_server::PortOwner& owner,
              PortLoan& loan)
      : io_(io), line_(line), owner_(owner), loan_(loan) {}

  void Start();
  /// `why`: "the gateway stops".
  void Stop(const std::string& why);
  /// Until Withdraw, which is due after `time`.
  void Offer(config::PortServer server, Duration time, Now now);
  /// Ends the offer: no client can connect there any more, and one that has the port loses it.
  void Withdraw(const std::string& why, Now now);

 private:
  void Close(const std::string& why);
  std::unique_ptr<serial_server::Server> Make(const config::PortServer& server,
                                              serial_server::Server::Use use);

  asio::io_context& io_;
  const config::Line& line_;
  serial_server::PortOwner& owner_;
  PortLoan& loan_;
  std::unique_ptr<serial_server::Server> server_;   // as configured; null: there is none
  std::unique_ptr<serial_server::Server> offered_;  // by hand; null: there is none
  config::PortServer offer_;                        // where that is
};

class LineRunner final : private transports::TransportListener, private serial_server::PortOwner {
 public:
  /// All references outlive the runner. Nothing happens before Start.
  LineRunner(asio::io_context& loop, std::shared_ptr<const config::Line> line,
             std::uint32_t first_device, const bus::Poller::FindProtocol& find,
             bus::PointStore& store, LineParts::Links links = {});
  /// Stopped, if it was started: the loop must not have ended before.
  ~LineRunner() override { Stop(); }

  /// The loop runs, or will soon.
  void Start();
  /// Closes the port and answers what is queued, soon; from any thread. Nothing may be submitted
  /// after it. `why`: for the log, and for clients that are connected or wait.
  void RequestStop(const std::string& why = "the gateway stops");
  /// The same, and waits until nothing of this line is left on the loop: as long as the driver
  /// needs for the present call. Any thread but the loop's.
  void Stop();
  /// The same, but waits at most this long; false: Stop must be called again before anything that
  /// the line uses is destroyed.
  bool StopBefore(Instant deadline);

  /// The line is abandoned, because it cannot be stopped: see LineReporter. From any thread.
  void Retire() { line_.reporter.Retire(); }

  /// Since when the loop hangs; empty: it does not. Until it runs again, requests are refused. From
  /// any thread.
  void SetStuck(std::optional<WallTime> since) { stuck_since_ = since.value_or(WallTime{}); }
  std::optional<WallTime> stuck_since() const {
    const WallTime since = stuck_since_;
    return since == WallTime{} ? std::nullopt : std::optional(since);
  }

  // From any thread; see CommandSink and RouteTarget.
  bool Submit(bus::WriteCommand command);
  bool Submit(bus::RoutedRequest request);

  /// Calls `call` with the parts of the line and the time on the loop, soon; from any thread.
  template <typename Call>
  void Post(Call call) {
    asio::post(io_, [this, call = std::move(call)]() mutable { Handle(std::move(call)); });
  }

  // See LineControl; from any thread, done soon after.
  void Offer(config::PortServer server, Duration time);
  void TakeBack();

  records::LineRecorder& recorder() { return line_.recorder; }  // any thread may read it
  bool is_open() const { return line_.port.is_open(); }         // from any thread

 private:
  void OnOpened() override;
  void OnOpenFailed(const std::string& reason) override;
  void OnNoConnection(const std::string& reason, transports::NoConnection why) override;
  void OnBytes(View bytes) override;
  void OnLost(const std::string& reason) override;
  void OnStuck(const std::string& reason) override;
  void OnEnded(const std::string& reason, bool unread) override;
  void OnRoom() override { line_.loan.OnRoom(); }

  // From the servers of its port.
  void Want(serial_server::PortUser& user, const serial_server::Visit& visit, Now now) override;
  void Return(serial_server::PortUser& user, const serial_server::Visit& visit,
              const std::string& why, Now now) override;
  void OnListening(const std::string& place, const std::string& trouble, Now now) override;

  /// One input of the line, on its loop.
  template <typename Call>
  void Handle(Call call) {
    const Now now = ReadClocks();
    call(line_, now);
    line_.Settle(now);
    Arm();
  }
  void Arm();

  asio::io_context& io_;
  const std::shared_ptr<const config::Line> config_;  // as the line began: all parts refer to it
  asio::steady_timer timer_;
  Instant armed_ = Instant::max();  // when the timer ends; max: it does not run
  transports::PortKeeper keeper_;   // while the port is down
  const std::unique_ptr<transports::Transport> transport_;
  LineParts line_;
  LineServers servers_;
  asio::steady_timer offer_end_;
  bus::CommandRoom queued_{
      bus::Poller::kQueueLimit};         // for commands handed over and not yet answered
  std::atomic<std::size_t> routed_ = 0;  // the same for routed requests
  std::atomic<WallTime> stuck_since_ = WallTime{};
  bool started_ = false;
  bool stopping_ = false;
  std::shared_ptr<std::promise<void>> stopped_ = std::make_shared<std::promise<void>>();
  const std::future<void> ended_ = stopped_->get_future();
};

// The number of a line for as long as the gateway runs, and the line itself, if there still is one:
// a caller need not know whether a reload has ended it. All calls from any thread.
class LineSlot final : public bus::RouteTarget {
 public:
  /// Why a request for it ends while there is no line.
  static constexpr const char* kNotThere =
      "its line does not run: a reload is adding the line, or has removed it";

  bool Submit(bus::RoutedRequest request) override {
    bool taken = true;
    const bool there = With([&](LineRunner& runner) { taken = runner.Submit(std::move(request)); });
    if (!there) request.done({Outcome::line_down, {}, kNotThere});
    return taken;
  }
  void Abandon(std::uint64_t client) override {
    Post([client](LineParts& line, Now now) { line.poller.Abandon(client, now); });
  }

  /// Calls `call` with the line, which stays until it returns; false: there is none.
  template <typename Call>
  bool With(Call call) const {
    const MutexLock lock(mutex_);
    if (!runner_) return false;
    call(*runner_);
    return true;
  }

  /// Calls `call` with the parts of the line and the time on its loop, soon, if there is a line.
  template <typename Call>
  void Post(Call call) const {
    With([&](LineRunner& runner) { runner.Post(std::move(call)); });
  }

  /// For gateway/lines/lines.cpp, which puts and takes it; null: there is none.
  LineRunner* mine() const {
    const MutexLock lock(mutex_);
    return runner_.get();
  }
  void Put(std::unique_ptr<LineRunner> runner) {
    const MutexLock lock(mutex_);
    runner_ = std::move(runner);
  }
  /// No call reaches the line after this.
  std::unique_ptr<LineRunner> Take() {
    const MutexLock lock(mutex_);
    return std::move(runner_);
  }

 private:
  mutable Mutex mutex_;
  std::unique_ptr<LineRunner> runner_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::lines
