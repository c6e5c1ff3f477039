// SPDX-License-Identifier: Apache-2.0
#include "gateway/line_runner.h"

#include <pthread.h>
#include <sys/prctl.h>

#include <asio/post.hpp>
#include <filesystem>
#include <functional>

#include "gateway/log.h"

namespace baudgate {
namespace {

/// A missing device file is looked for so often: cheap, and soon enough after plugging in.
constexpr Duration kLookForPort = 500ms;
/// A connection behind which every device has been silent so long is made anew: a serial server may
/// keep its TCP alive although its serial side hangs.
constexpr Duration kSilenceLimit = 30s;

bool IsNetwork(const std::string& port) { return port.starts_with("tcp://"); }

bool IsMissing(const std::string& port) {
  std::error_code error;
  return !IsNetwork(port) && !std::filesystem::exists(port, error);
}

}  // namespace

LineRunner::LineRunner(const config::Line& line, std::uint32_t first_device,
                       const Poller::FindProtocol& find, PointStore& store)
    : config_(line),
      store_(store),
      io_(1),
      work_(io_.get_executor()),
      timer_(io_),
      reopen_timer_(io_),
      silence_timer_(io_),
      transport_(MakeTransport(line, io_, *this)),
      echo_(line.echo),
      poller_(line, first_device, find, store, *this),
      ladder_(static_cast<std::uint32_t>(std::hash<std::string>{}(line.name))) {}

LineRunner::~LineRunner() { Stop(); }

void LineRunner::Start() {
  asio::post(io_, [this] { Open(); });
  thread_ = std::thread([this] { Run(); });
}

void LineRunner::Run() {
  pthread_setname_np(pthread_self(), ("line " + config_.name).substr(0, 15).c_str());
  // The gaps between frames are a few milliseconds: the default slack of 50 us on every timer
  // shows.
  prctl(PR_SET_TIMERSLACK, 1UL);
  io_.run();
}

void LineRunner::Stop() {
  if (!thread_.joinable()) return;
  asio::post(io_, [this] {
    timer_.cancel();
    reopen_timer_.cancel();
    silence_timer_.cancel();
    transport_->Close();
    if (open_.exchange(false)) poller_.OnClosed(ReadClocks());
    work_.reset();
    io_.stop();
  });
  thread_.join();
}

bool LineRunner::Submit(WriteCommand command) {
  if (queued_.fetch_add(1) >= Poller::kQueueLimit) {
    --queued_;
    return false;
  }
  command.done = [this, done = std::move(command.done)](Outcome outcome,
                                                        const std::string& reason) {
    --queued_;
    done(outcome, reason);
  };
  asio::post(io_, [this, command = std::move(command)]() mutable {
    // The counter above keeps the queue within its limit, so the poller never says no.
    poller_.Submit(std::move(command), ReadClocks());
    Arm();
  });
  return true;
}

// ---------------------------------------------------------------- the port

void LineRunner::Open() { transport_->Open(); }

void LineRunner::OnOpened() {
  open_ = true;
  applied_ = &config_.serial;
  echo_.OnExchangeEnd();  // of an exchange that the port did not survive
  last_trouble_.clear();
  ladder_.Reset();
  log::Info("line {}: open ({})", config_.name, transport_->Describe());
  poller_.OnOpened(ReadClocks());
  Arm();
  if (IsNetwork(config_.port)) CheckSilence();
}

void LineRunner::OnOpenFailed(const std::string& reason) { Down(reason); }

void LineRunner::OnLost(const std::string& reason) {
  open_ = false;
  timer_.cancel();
  silence_timer_.cancel();
  poller_.OnClosed(ReadClocks());
  Down(reason);
}

void LineRunner::Down(const std::string& reason) {
  if (reason != last_trouble_) {
    log::Warn("line {}: down: {}; trying again until it works", config_.name, reason);
    last_trouble_ = reason;
  }
  RetryOpen(IsMissing(config_.port) ? kLookForPort : ladder_.Next());
}

void LineRunner::RetryOpen(Duration wait) {
  reopen_timer_.expires_after(wait);
  reopen_timer_.async_wait([this](const asio::error_code& error) {
    if (error) return;
    if (IsMissing(config_.port)) {
      // The full open explains itself in the log when the reason is new.
      ladder_.Reset();
      if (!last_trouble_.empty()) return RetryOpen(kLookForPort);
    }
    Open();
  });
}

void LineRunner::CheckSilence() {
  silence_timer_.expires_after(kSilenceLimit / 4);
  silence_timer_.async_wait([this](const asio::error_code& error) {
    if (error || !open_) return;
    if (!poller_.SilentSince(std::chrono::steady_clock::now() - kSilenceLimit)) {
      return CheckSilence();
    }
    transport_->Close();
    OnLost("no device behind it has answered for " + FormatDuration(kSilenceLimit) +
           "; the connection is made anew");
  });
}

// ---------------------------------------------------------------- bytes

void LineRunner::OnBytes(View bytes) {
  if (config_.echo == config::Echo::off) {
    poller_.OnBytes(bytes, ReadClocks());
  } else {
    Receive(echo_.Filter(bytes));
  }
  Arm();
}

void LineRunner::Receive(const EchoResult& result) {
  if (result.collision) WarnOfCollision();
  if (!result.bytes.empty()) poller_.OnBytes(result.bytes, ReadClocks());
}

void LineRunner::WarnOfCollision() {
  log::Warn(
      "line {}: the echo is missing or differs from what was sent: a collision, or a bus that does "
      "not echo (echo: off)",
      config_.name);
}

void LineRunner::Send(View bytes, const config::SerialSettings& serial) {
  if (&serial != applied_) {
    const Status status = transport_->Apply(serial);
    if (!status) log::Warn("line {}: {}", config_.name, status.error());
    applied_ = &serial;
  }
  echo_.OnSent(bytes);
  transport_->Send(bytes);
}

void LineRunner::Arm() {
  const auto deadline = poller_.Deadline();
  if (!deadline) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(*deadline);
  timer_.async_wait([this](const asio::error_code& error) {
    if (error) return;
    poller_.OnTimer(ReadClocks());
    Arm();
  });
}

// ---------------------------------------------------------------- news of devices

void LineRunner::OnExchangeEnd(std::uint32_t, Outcome) {
  if (config_.echo == config::Echo::off) return;
  // What the filter still holds belongs to the exchange that has ended: it must not reach the next.
  if (echo_.OnExchangeEnd().collision) WarnOfCollision();
}

void LineRunner::OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                               const std::string& reason) {
  const std::string& name = store_.device(device).name;
  if (to == DeviceState::online) {
    log::Info("line {}: device {}: {} (was {})", config_.name, name, Name(to), Name(from));
  } else {
    log::Warn("line {}: device {}: {} (was {}): {}", config_.name, name, Name(to), Name(from),
              reason);
  }
}

void LineRunner::OnWarning(std::uint32_t device, const std::string& message) {
  log::Warn("line {}: device {}: {}", config_.name, store_.device(device).name, message);
}

}  // namespace baudgate
