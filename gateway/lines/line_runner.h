// Runs one line for real on an event loop that it may share with other lines: joins a transport and
// the clocks with the parts of the line (line_parts.h), which hold the rules. On a shared loop
// nothing here blocks; a local serial port, whose driver may, gets a loop of its own (placement.h).
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

#include "gateway/bus/writes/command_room.h"
#include "gateway/bus/writes/routed.h"
#include "gateway/lines/line_parts.h"
#include "gateway/lines/line_servers.h"

namespace baudgate {

class LineRunner final : private TransportListener, private serial_server::PortOwner {
 public:
  /// All references outlive the runner. Nothing happens before Start.
  LineRunner(asio::io_context& loop, const config::Line& line, std::uint32_t first_device,
             const Poller::FindProtocol& find, PointStore& store, LineParts::Links links = {});
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
  bool Submit(WriteCommand command);
  bool Submit(RoutedRequest request);

  /// Calls `call` with the parts of the line and the time on the loop, soon; from any thread.
  template <typename Call>
  void Post(Call call) {
    asio::post(io_, [this, call = std::move(call)]() mutable { Handle(std::move(call)); });
  }

  // See LineControl; from any thread, done soon after.
  void Offer(config::PortServer server, Duration time);
  void TakeBack();

  LineRecorder& recorder() { return line_.recorder; }    // any thread may read it
  bool is_open() const { return line_.port.is_open(); }  // from any thread

 private:
  void OnOpened() override;
  void OnOpenFailed(const std::string& reason) override;
  void OnNoConnection(const std::string& reason, NoConnection why) override;
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
  asio::steady_timer timer_;
  Instant armed_ = Instant::max();  // when the timer ends; max: it does not run
  PortKeeper keeper_;               // while the port is down
  const std::unique_ptr<Transport> transport_;
  LineParts line_;
  LineServers servers_;
  asio::steady_timer offer_end_;
  CommandRoom queued_{Poller::kQueueLimit};  // for commands handed over and not yet answered
  std::atomic<std::size_t> routed_ = 0;      // the same for routed requests
  std::atomic<WallTime> stuck_since_ = WallTime{};
  bool started_ = false;
  bool stopping_ = false;
  std::shared_ptr<std::promise<void>> stopped_ = std::make_shared<std::promise<void>>();
  const std::future<void> ended_ = stopped_->get_future();
};

}  // namespace baudgate
