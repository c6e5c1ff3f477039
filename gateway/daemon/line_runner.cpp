// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/line_runner.h"

#include <pthread.h>
#include <sys/prctl.h>

#include <asio/post.hpp>
#include <utility>

#include "gateway/base/log.h"

namespace baudgate {
namespace {

/// A connection behind which every device has been silent so long is made anew: a serial server may
/// keep its TCP alive although its serial side hangs.
constexpr Duration kSilenceLimit = 30s;
/// Some serial servers say in words that they are in use, then close: bytes prove a connection that
/// has lasted so long.
constexpr Duration kGreeting = 500ms;
/// The driver's counters cost a call into it.
constexpr Duration kCountErrorsEvery = 1s;
/// A write under way is ended in order before the port is given up, so that no password stays open;
/// but not for longer.
constexpr Duration kPatience = 1s;

bool IsNetwork(const std::string& port) { return port.starts_with("tcp://"); }

}  // namespace

LineRunner::LineRunner(const config::Line& line, std::uint32_t first_device,
                       const Poller::FindProtocol& find, PointStore& store,
                       LineRecorder::Sink recordings)
    : config_(line),
      store_(store),
      line_(store.LineIndex(line)),
      io_(1),
      work_(io_.get_executor()),
      timer_(io_),
      silence_timer_(io_),
      loan_timer_(io_),
      patience_timer_(io_),
      keeper_(io_, line.port, [this] { Open(); }),
      transport_(MakeTransport(line, io_, *this)),
      recorder_(line, first_device, std::move(recordings)),
      poller_(line, first_device, find, store, *this) {
  poller_.Attach(recorder_);
  ShowPort(LineStatus::Port::closed, "not opened yet");
}

LineRunner::~LineRunner() { Stop(); }

void LineRunner::Start() {
  asio::post(io_, [this] {
    if (!lent_until_) Open();
  });
  thread_ = std::thread([this] { Run(); });
}

void LineRunner::Run() {
  pthread_setname_np(pthread_self(), ("line " + config_.name).substr(0, 15).c_str());
  // The gaps between frames are a few milliseconds: the default slack of 50 us on every timer
  // shows.
  prctl(PR_SET_TIMERSLACK, 1UL);
  io_.run();
}

void LineRunner::RequestStop() {
  asio::post(io_, [this] {
    loan_timer_.cancel();
    AfterTheWrite([this] {
      ClosePort();
      if (open_.exchange(false)) poller_.OnClosed(ReadClocks());
      work_.reset();
      io_.stop();
    });
  });
}

void LineRunner::Stop() {
  if (!thread_.joinable()) return;
  RequestStop();
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

bool LineRunner::Submit(RoutedRequest request) {
  if (routed_.fetch_add(1) >= RouteQueue::LimitFor(request)) {
    --routed_;
    return false;
  }
  request.done = [this, done = std::move(request.done)](RoutedReply reply) {
    --routed_;
    done(std::move(reply));
  };
  asio::post(io_, [this, request = std::move(request)]() mutable {
    poller_.Submit(std::move(request), ReadClocks());
    Arm();
  });
  return true;
}

void LineRunner::Forget(std::uint64_t client) {
  asio::post(io_, [this, client] {
    routed_ -= poller_.Forget(client, ReadClocks());
    Arm();
  });
}

void LineRunner::SetInUse(std::uint32_t device, bool in_use) {
  asio::post(io_, [this, device, in_use] {
    poller_.SetInUse(device, in_use, ReadClocks());
    Arm();
  });
}

// ---------------------------------------------------------------- the port

void LineRunner::Open() { transport_->Open(); }

/// And nothing that would open it again.
void LineRunner::ClosePort() {
  timer_.cancel();
  silence_timer_.cancel();
  keeper_.Stop();
  vain_ = false;
  transport_->Close();
}

void LineRunner::OnOpened() {
  open_ = true;
  applied_ = &config_.serial;
  out_of_service_ = false;
  opened_ = ReadClocks().instant;
  works_ = !IsNetwork(config_.port);
  heard_ = false;
  keeper_.OnOpened();
  if (!vain_) Announce();
  CountErrors(opened_);
  poller_.OnOpened(ReadClocks(), transport_->KeepsBitRate());
  Arm();
  if (IsNetwork(config_.port)) CheckConnection(kGreeting);
}

void LineRunner::Announce() {
  log::Info("line {}: open ({})", config_.name, transport_->Describe());
  ShowPort(LineStatus::Port::open, transport_->Describe());
}

void LineRunner::PortWorks() {
  works_ = true;
  keeper_.OnWorked();
  if (std::exchange(vain_, false)) Announce();
}

void LineRunner::OnOpenFailed(const std::string& reason) {
  // The time of the loan is over, but the port is not ours yet.
  if (std::exchange(out_of_service_, false)) poller_.OnClosed(ReadClocks());
  Down(reason);
}

void LineRunner::OnLost(const std::string& reason) {
  open_ = false;
  timer_.cancel();
  silence_timer_.cancel();
  store_.UpdateLine(line_, [](LineStatus& status) { ++status.times_lost; });
  poller_.OnClosed(ReadClocks());
  vain_ = !works_;
  Down(works_ ? reason
              : reason +
                    ", before it had worked; is the server in use by another client, or at "
                    "its connection limit?");
}

void LineRunner::Down(const std::string& reason) {
  if (keeper_.OnDown(reason)) {
    log::Warn("line {}: down: {}; trying again until it works", config_.name, reason);
  }
  if (reason != shown_) ShowPort(LineStatus::Port::closed, reason);
}

void LineRunner::ShowPort(LineStatus::Port port, const std::string& text, WallTime released_until) {
  const Now now = ReadClocks();
  shown_ = text;
  store_.UpdateLine(line_, [&](LineStatus& status) {
    if (status.port != port || status.port_text.empty()) status.port_since = now.wall;
    status.port = port;
    status.port_text = text;
    status.released_until = released_until;
  });
  recorder_.OnPort(fmt::format("port {}: {}", Name(port), text), now);
}

void LineRunner::CountErrors(Instant now) {
  errors_counted_ = now;
  const PortCounters errors = transport_->Counters();
  store_.UpdateLine(line_, [&](LineStatus& status) {
    status.parity_errors = errors.parity;
    status.framing_errors = errors.framing;
    status.overruns = errors.overrun;
  });
}

// ---------------------------------------------------------------- the port, lent

void LineRunner::Release(Duration time) {
  asio::post(io_, [this, time] { AfterTheWrite([this, time] { Lend(time); }); });
}

void LineRunner::TakeBack() {
  asio::post(io_, [this] { EndLoan(); });
}

void LineRunner::AfterTheWrite(std::function<void()> then) {
  after_write_ = std::move(then);
  poller_.WindUp();
  patience_timer_.expires_after(kPatience);
  patience_timer_.async_wait([this](const asio::error_code& error) {
    if (error || !after_write_) return;
    log::Warn(
        "line {}: a write is broken off; what it has opened, such as a password, may stay open",
        config_.name);
    GoOn();
  });
  if (!poller_.IsWriting()) GoOn();
}

void LineRunner::GoOn() {
  patience_timer_.cancel();
  std::exchange(after_write_, {})();
}

void LineRunner::Lend(Duration time) {
  const Now now = ReadClocks();
  lent_until_ = now.instant + time;
  loan_timer_.expires_at(*lent_until_);
  loan_timer_.async_wait([this](const asio::error_code& error) {
    // One that has been prolonged may have come to its first end in this very moment.
    if (!error && lent_until_ && *lent_until_ <= std::chrono::steady_clock::now()) EndLoan();
  });
  out_of_service_ = true;
  open_ = false;
  ClosePort();
  poller_.OnReleased(now);
  log::Info("line {}: {} is released for {}; its points are out of service", config_.name,
            config_.port, FormatDuration(time));
  ShowPort(LineStatus::Port::released, "released for " + FormatDuration(time), now.wall + time);
}

void LineRunner::EndLoan() {
  if (!lent_until_) return;
  lent_until_.reset();
  loan_timer_.cancel();
  log::Info("line {}: takes {} back", config_.name, config_.port);
  ShowPort(LineStatus::Port::closed, "being taken back");
  Open();
}

void LineRunner::CheckConnection(Duration wait) {
  silence_timer_.expires_after(wait);
  silence_timer_.async_wait([this](const asio::error_code& error) {
    if (error || !open_) return;
    // Where nobody is asked nothing comes, and where nobody answers it is not the connection's
    // fault: one that has held for long works.
    const Instant now = std::chrono::steady_clock::now();
    if (!works_ && (heard_ || now - opened_ >= kSilenceLimit)) PortWorks();
    if (!poller_.SilentSince(now - kSilenceLimit)) return CheckConnection(kSilenceLimit / 4);
    transport_->Close();
    OnLost("no device behind it has answered for " + FormatDuration(kSilenceLimit) +
           "; the connection is made anew");
  });
}

// ---------------------------------------------------------------- bytes

void LineRunner::OnBytes(View bytes) {
  const Now now = ReadClocks();
  heard_ = true;
  if (!works_ && now.instant - opened_ >= kGreeting) PortWorks();
  poller_.OnBytes(bytes, now);
  Arm();
}

void LineRunner::Send(View bytes, const config::SerialSettings& serial) {
  if (&serial != applied_) {
    const Status status = transport_->Apply(serial);
    if (!status) log::Warn("line {}: {}", config_.name, status.error());
    applied_ = &serial;
  }
  transport_->Send(bytes);
  const Instant now = std::chrono::steady_clock::now();
  if (now - errors_counted_ >= kCountErrorsEvery) CountErrors(now);
}

void LineRunner::Arm() {
  if (after_write_ && !poller_.IsWriting()) return GoOn();
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

void LineRunner::OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                               const std::string& reason) {
  const std::string name = recorder_.NameOf(device);
  if (to == DeviceState::online) {
    log::Info("line {}: device {}: {} (was {})", config_.name, name, Name(to), Name(from));
  } else if (to == DeviceState::disabled || from == DeviceState::disabled) {
    log::Info("line {}: device {}: {} (was {}): {}", config_.name, name, Name(to), Name(from),
              reason);
  } else {
    log::Warn("line {}: device {}: {} (was {}): {}", config_.name, name, Name(to), Name(from),
              reason);
  }
}

void LineRunner::OnWarning(std::uint32_t device, const std::string& message) {
  log::Warn("line {}: device {}: {}", config_.name, recorder_.NameOf(device), message);
}

}  // namespace baudgate
