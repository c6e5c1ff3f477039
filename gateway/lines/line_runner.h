// `LineRunner` runs one line on an event loop: it connects a transport and the clocks with the
// parts of the line (`LineParts`), which contain the rules. Lines share loops, and nothing here
// blocks a shared loop; a serial port, whose driver can block, has a separate loop
// (gateway/lines/lines.h).
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

/// The parts of one line. They have no thread and no clock: LineRunner passes bytes, calls and the
/// time, and calls Settle after each of them. Not thread-safe, except where a part documents it.
/// `now` must never go back.
class LineParts {
 public:
  struct Links {
    records::LineRecorder::Sink recordings{};
    /// Null: what conversations learn is lost at the end of the program.
    records::DeviceMemory* memory = nullptr;
    /// Null: events are dropped.
    bus::EventSink* events = nullptr;
    LoanRecords loans{};
    /// Rules that recognise the messages of other protocols.
    std::vector<protocols::ForeignRule> foreign{};
  };

  /// The references must outlive this object.
  LineParts(const config::Line& line, std::uint32_t first_device,
            const bus::Poller::FindProtocol& find, bus::PointStore& store,
            transports::Transport& transport, transports::PortRetries& retries, Links links);

  /// Restores from DeviceMemory what the conversations had learned, and opens the port.
  void Start(Now now);
  /// The caller must limit unanswered commands to Poller::kQueueLimit (see bus::CommandRoom).
  void Submit(bus::WriteCommand command, Now now);
  /// Called when events of a device are on the disk; see gateway/records/event_path.h (Kept).
  void OnEventsKept(std::uint32_t device, const std::string& said, bool reported, Now now);
  /// Must be called at Deadline(). An earlier call does nothing.
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;
  /// Must be called after every input of the line, because an exchange or a write may have ended.
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

// LineServers contains the servers for the port of one line: the configured server, and the
// temporary server of `baudgate release --tcp`. Only the loop of the line may call it.
class LineServers {
 public:
  /// The references must outlive this object. `owner` gets the requests of the servers for the
  /// port, and must pass them to `loan`.
  LineServers(asio::io_context& io, const config::Line& line, serial_server::PortOwner& owner,
              PortLoan& loan)
      : io_(io), line_(line), owner_(owner), loan_(loan) {}

  void Start();
  void Stop(const std::string& why);
  /// Starts the temporary server. The caller must call Withdraw after `time`.
  void Offer(config::PortServer server, Duration time, Now now);
  /// Ends the temporary server: no client can connect any more, and a client that has the port
  /// loses it.
  void Withdraw(const std::string& why, Now now);

 private:
  void Close(const std::string& why);
  std::unique_ptr<serial_server::Server> Make(const config::PortServer& server,
                                              serial_server::Server::Use use);

  asio::io_context& io_;
  const config::Line& line_;
  serial_server::PortOwner& owner_;
  PortLoan& loan_;
  std::unique_ptr<serial_server::Server> server_;   // null: no server is configured
  std::unique_ptr<serial_server::Server> offered_;  // null: there is no temporary server
  config::PortServer offer_;                        // address and mode of `offered_`
};

class LineRunner final : private transports::TransportListener, private serial_server::PortOwner {
 public:
  /// The references must outlive the runner.
  LineRunner(asio::io_context& loop, std::shared_ptr<const config::Line> line,
             std::uint32_t first_device, const bus::Poller::FindProtocol& find,
             bus::PointStore& store, LineParts::Links links = {});
  /// Stops the line. If the line was started, the loop must still run.
  ~LineRunner() override { Stop(); }

  void Start();
  /// Makes the loop close the port and answer all queued requests soon. No request must be
  /// submitted afterwards. `why` is for the log, and for clients that are connected or wait.
  /// Thread-safe.
  void RequestStop(const std::string& why = "the gateway stops");
  /// Stops the line and waits until its loop has no handler of the line left; a call of the driver
  /// that hangs prolongs the wait. Must not be called on the loop's thread.
  void Stop();
  /// Like Stop, but waits until `deadline` at the latest. Returns false if the line has not ended:
  /// Stop must then be called again before anything that the line uses is destroyed.
  bool StopBefore(Instant deadline);

  /// Drops all further news (OnNews) of a line that is abandoned because it cannot be stopped.
  /// Thread-safe.
  void Retire() { line_.reporter.Retire(); }

  /// Sets since when the loop hangs; empty: the loop runs. While the loop hangs, requests are
  /// refused. Thread-safe.
  void SetStuck(std::optional<WallTime> since) { stuck_since_ = since.value_or(WallTime{}); }
  std::optional<WallTime> stuck_since() const {
    const WallTime since = stuck_since_;
    return since == WallTime{} ? std::nullopt : std::optional(since);
  }

  // Submit returns false if too many requests are queued. Thread-safe.
  bool Submit(bus::WriteCommand command);
  bool Submit(bus::RoutedRequest request);

  /// Calls `call` soon on the loop, with the parts of the line and the time. Thread-safe.
  template <typename Call>
  void Post(Call call) {
    asio::post(io_, [this, call = std::move(call)]() mutable { Handle(std::move(call)); });
  }

  // See LineControl. The functions are thread-safe; the effect follows soon.
  void Offer(config::PortServer server, Duration time);
  void TakeBack();

  records::LineRecorder& recorder() { return line_.recorder; }
  bool is_open() const { return line_.port.is_open(); }  // thread-safe

 private:
  void OnOpened() override;
  void OnOpenFailed(const std::string& reason) override;
  void OnNoConnection(const std::string& reason, transports::NoConnection why) override;
  void OnBytes(View bytes) override;
  void OnLost(const std::string& reason) override;
  void OnStuck(const std::string& reason) override;
  void OnEnded(const std::string& reason, bool unread) override;
  void OnRoom() override { line_.loan.OnRoom(); }

  void Want(serial_server::PortUser& user, const serial_server::Visit& visit, Now now) override;
  void Return(serial_server::PortUser& user, const serial_server::Visit& visit,
              const std::string& why, Now now) override;
  void OnListening(const std::string& place, const std::string& trouble, Now now) override;
  void OnArrival(const Arrival& arrival, Now now) override { line_.loan.OnArrival(arrival, now); }

  template <typename Call>
  void Handle(Call call) {
    const Now now = ReadClocks();
    call(line_, now);
    line_.Settle(now);
    Arm();
  }
  void Arm();

  asio::io_context& io_;
  // The configuration with which the line was started; all parts refer to it.
  const std::shared_ptr<const config::Line> config_;
  asio::steady_timer timer_;
  Instant armed_ = Instant::max();  // when the timer ends; max: it does not run
  transports::PortKeeper keeper_;
  const std::unique_ptr<transports::Transport> transport_;
  LineParts line_;
  LineServers servers_;
  asio::steady_timer offer_end_;
  // Counts commands that were submitted and not answered yet.
  bus::CommandRoom queued_{bus::Poller::kQueueLimit};
  // Counts routed requests that were submitted and not answered yet.
  FairPlaces routed_{bus::RouteQueue::kLimit};
  std::atomic<WallTime> stuck_since_ = WallTime{};
  bool started_ = false;
  bool stopping_ = false;
  std::shared_ptr<std::promise<void>> stopped_ = std::make_shared<std::promise<void>>();
  const std::future<void> ended_ = stopped_->get_future();
};

// LineSlot has a number that never changes, and contains the line with this number while the line
// exists, so callers need not check whether a reload has ended the line. All calls are thread-safe.
class LineSlot final : public bus::RouteTarget {
 public:
  static constexpr const char* kNotThere =
      "its line does not run: a reload is adding the line, or has removed it; try again after the "
      "reload";

  bool Submit(bus::RoutedRequest request) override {
    bool taken = true;
    const bool there = With([&](LineRunner& runner) { taken = runner.Submit(std::move(request)); });
    if (!there) request.done({Outcome::line_down, {}, kNotThere});
    return taken;
  }
  void Abandon(std::uint64_t client) override {
    Post([client](LineParts& line, Now now) { line.poller.Abandon(client, now); });
  }

  /// Calls `call` with the line, which is not destroyed during the call. Returns false if the slot
  /// has no line.
  template <typename Call>
  bool With(Call call) const {
    const MutexLock lock(mutex_);
    if (!runner_) return false;
    call(*runner_);
    return true;
  }

  /// Calls LineRunner::Post if the slot contains a line, and does nothing otherwise.
  template <typename Call>
  void Post(Call call) const {
    With([&](LineRunner& runner) { runner.Post(std::move(call)); });
  }

  /// Returns the line; null if the slot has none. Only gateway/lines/lines.cpp, which puts lines
  /// into the slot and takes them out, is allowed to call it.
  LineRunner* mine() const {
    const MutexLock lock(mutex_);
    return runner_.get();
  }
  void Put(std::unique_ptr<LineRunner> runner) {
    const MutexLock lock(mutex_);
    runner_ = std::move(runner);
  }
  /// Takes the line out of the slot. No call reaches the line afterwards.
  std::unique_ptr<LineRunner> Take() {
    const MutexLock lock(mutex_);
    return std::move(runner_);
  }

 private:
  mutable Mutex mutex_;
  std::unique_ptr<LineRunner> runner_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::lines
