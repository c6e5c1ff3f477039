// Runs one line for real: one thread with an asio loop that joins a transport, the clocks, the
// flight recorder and gateway/poll/poller.h. Opening and closing a sick driver may block it, and
// only it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "config/model/line.h"
#include "gateway/poll/poller.h"
#include "gateway/requests/commands.h"
#include "gateway/requests/routed.h"
#include "gateway/store/point_store.h"
#include "gateway/trace/line_recorder.h"
#include "transports/port_keeper.h"
#include "transports/transport.h"

namespace baudgate {

class LineRunner final : public RouteTarget, private TransportListener, private PollerListener {
 public:
  /// All references outlive the runner. Nothing happens before Start.
  LineRunner(const config::Line& line, std::uint32_t first_device, const Poller::FindProtocol& find,
             PointStore& store, LineRecorder::Sink recordings = {});
  ~LineRunner() override;

  void Start();
  /// Closes the port and answers what is queued, soon; from any thread. Nobody submits after it.
  void RequestStop();
  /// The same, and waits for the end of the thread: as long as the driver needs for a call that it
  /// is in. Any thread but the line's.
  void Stop();

  /// From any thread; see CommandSink.
  bool Submit(WriteCommand command);

  // See RouteTarget.
  bool Submit(RoutedRequest request) override;
  void Forget(std::uint64_t client) override;

  // See LineControl; from any thread, done soon after.
  void Release(Duration time);
  void TakeBack();
  void SetInUse(std::uint32_t device, bool in_use);
  LineRecorder& recorder() { return recorder_; }

  bool is_open() const { return open_.load(); }

 private:
  void OnOpened() override;
  void OnOpenFailed(const std::string& reason) override;
  void OnBytes(View bytes) override;
  void OnLost(const std::string& reason) override;

  void Send(View bytes, const config::SerialSettings& serial) override;
  void OnNoReply() override { transport_->DropUnsent(); }
  void OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                     const std::string& reason) override;
  void OnWarning(std::uint32_t device, const std::string& message) override;

  void Run();
  void Open();
  void Announce();
  void PortWorks();
  void Down(const std::string& reason);
  void ClosePort();
  void AfterTheWrite(std::function<void()> then);
  void GoOn();
  void Lend(Duration time);
  void EndLoan();
  void ShowPort(LineStatus::Port port, const std::string& text, WallTime released_until = {});
  void CountErrors(Instant now);
  void Arm();
  void CheckConnection(Duration wait);

  const config::Line& config_;
  PointStore& store_;
  const std::uint32_t line_;  // in the store
  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  asio::steady_timer timer_;  // the poller's deadline
  asio::steady_timer silence_timer_;
  asio::steady_timer loan_timer_;
  asio::steady_timer patience_timer_;
  std::function<void()> after_write_;  // what waits for the end of the write under way
  PortKeeper keeper_;                  // while the port is down
  std::unique_ptr<Transport> transport_;
  LineRecorder recorder_;
  Poller poller_;
  const config::SerialSettings* applied_ = nullptr;  // what the open port is set to
  Instant opened_{};
  bool heard_ = false;  // the open port: bytes have come
  bool works_ = false;  // and it has worked
  bool vain_ = false;   // the last connection ended before it worked: the next one is no news yet
  std::string shown_;   // of the port, in the status
  std::optional<Instant> lent_until_;
  bool out_of_service_ = false;  // the points, since the port was lent
  Instant errors_counted_{};
  std::atomic<bool> open_ = false;
  std::atomic<std::size_t> queued_ = 0;  // commands handed over and not yet answered
  std::atomic<std::size_t> routed_ = 0;  // routed requests, alike
  std::thread thread_;
};

}  // namespace baudgate
