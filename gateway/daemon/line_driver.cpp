// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/line_driver.h"

#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/outcome.h"
#include "gateway/daemon/not_opened_yet.h"
#include "gateway/trace/tap.h"

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

Duration ReplyTime(const config::Line& line, const Poller::FindProtocol& find) {
  return *config::Resolve(line.timing, find(line.protocol).timing(line.serial)).reply;
}

}  // namespace

LineDriver::LineDriver(const config::Line& line, std::uint32_t first_device,
                       const Poller::FindProtocol& find, PointStore& store, Transport& port,
                       PortRetries& retries, LineRecorder::Sink recordings, DeviceMemory* memory,
                       EventSink* events, const LoanRecords& loans)
    : config_(line),
      first_device_(first_device),
      store_(store),
      line_(store.LineIndex(line)),
      port_(port),
      retries_(retries),
      recorder_(line, first_device, std::move(recordings)),
      memory_(memory),
      events_(events),
      news_(line, events),
      poller_(line, first_device, find, store, *this),
      hand_(line, poller_, recorder_,
            [this](View bytes, const config::SerialSettings& serial) {
              hand_serial_ = serial;
              applied_ = nullptr;
              Send(bytes, hand_serial_);
            }),
      loan_({line, store, port, news_, loans, ReplyTime(line, find)}, *this),
      listens_(find(line.protocol).unasked) {
  poller_.Attach(recorder_);
}

void LineDriver::Start(Now now) {
  now_ = now;
  Recall();
  if (lent_until_ || stopping_) return;
  ShowPort(LineStatus::Port::closed, std::string(kNotOpenedYet));
  port_.Open();
}

void LineDriver::Recall() {
  if (memory_ == nullptr) return;
  for (std::size_t i = 0; i < config_.devices.size(); ++i) {
    const auto device = first_device_ + static_cast<std::uint32_t>(i);
    poller_.Recall(device, memory_->Of(device), now_);
  }
}

void LineDriver::Stop(Now now, std::function<void()> stopped) {
  now_ = now;
  stopping_ = true;
  lent_until_.reset();
  loan_.OnClosed("the gateway stops", now);
  AfterTheWrite([this, stopped = std::move(stopped)] {
    ClosePort();
    hand_.OnClosed("the gateway stops");
    if (open_.exchange(false)) poller_.OnClosed(now_);
    stopped();
  });
}

// ---------------------------------------------------------------- the port

/// And nothing that would open it again.
void LineDriver::ClosePort() {
  check_at_.reset();
  look_at_.reset();
  retries_.Stop();
  connection_ = Connection::fresh;
  rest_.End();
  port_.Close();
}

/// Replies of devices, so far.
std::uint64_t LineDriver::Answers() const {
  std::uint64_t answers = 0;
  const auto& outcomes = poller_.ledger().counters().outcomes;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    if (ProvesLife(static_cast<Outcome>(i))) answers += outcomes[i];
  }
  return answers;
}

void LineDriver::OnOpened(Now now) {
  now_ = now;
  if (rest_.OnOpened(Answers())) {
    if (const Bytes request = rest_.TakeHeld(); !request.empty()) port_.Send(request);
    return;
  }
  open_ = true;
  applied_ = &config_.serial;
  out_of_service_ = false;
  opened_ = now.instant;
  // Behind a useless connection the next one is news only once it works.
  announced_ = connection_ != Connection::useless;
  connection_ = config_.is_network() ? Connection::fresh : Connection::proven;
  retries_.OnOpened();
  if (announced_) Announce();
  LookAtPort();
  if (config_.is_network()) check_at_ = now.instant + kGreeting;
  poller_.OnOpened(now, port_.KeepsBitRate());
  Settle();
}

void LineDriver::Announce() {
  times_restored_ = 0;
  const std::string text = port_.Describe();
  log::Info({.line = config_.name}, "open ({})", text);
  ShowPort(LineStatus::Port::open, text);
  news_.Tell({News::What::port_down, true, {}, text}, now_);
  news_.Tell({News::What::port_lent, true, {}, text}, now_);
}

void LineDriver::Prove() {
  connection_ = Connection::proven;
  retries_.OnWorked();
  if (!std::exchange(announced_, true)) Announce();
}

void LineDriver::OnOpenFailed(const std::string& reason, Now now) {
  now_ = now;
  if (rest_.rests()) {
    Lost(reason);
    return Settle();
  }
  // The time of the loan is over, but the port is not ours yet.
  if (std::exchange(out_of_service_, false)) poller_.OnClosed(now);
  Down(reason);
  Settle();
}

void LineDriver::OnLost(const std::string& reason, Now now) {
  now_ = now;
  store_.UpdateLine(line_, [](LineStatus& status) { ++status.times_lost; });
  Lost(reason);
  Settle();
}

void LineDriver::OnEnded(const std::string& reason, Now now) {
  const bool several = config_.devices.size() > 1;
  if (listens_ || !rest_.OnEnded(Answers(), several)) return OnLost(reason, now);
  now_ = now;
  if (connection_ != Connection::proven && !rest_.in_vain()) Prove();
  poller_.OnEnded(now);
  Settle();
}

void LineDriver::Lost(const std::string& reason) {
  open_ = false;
  rest_.End();
  check_at_.reset();
  look_at_.reset();
  hand_.OnClosed("the port was lost");
  loan_.OnClosed("the port is lost: " + reason, now_);
  poller_.OnClosed(now_);
  if (connection_ == Connection::proven) return Down(reason);
  connection_ = Connection::useless;
  Down(reason +
       ", before it had worked; is the server in use by another client, or at its connection "
       "limit?");
}

void LineDriver::Down(const std::string& reason) {
  if (retries_.OnDown(reason)) {
    log::Warn({.line = config_.name, .outcome = std::string(Name(Outcome::line_down))},
              "down: {}; trying again until it works", reason);
  }
  if (reason != shown_) ShowPort(LineStatus::Port::closed, reason);
  news_.Tell({News::What::port_down, false, {}, reason}, now_);
}

void LineDriver::ShowPort(LineStatus::Port port, const std::string& text, WallTime released_until) {
  shown_ = text;
  store_.UpdateLine(line_, [&](LineStatus& status) {
    if (status.port != port || status.port_text.empty()) status.port_since = now_.wall;
    status.port = port;
    status.port_text = text;
    status.released_until = released_until;
  });
  recorder_.OnPort(fmt::format("port {}: {}", Name(port), text), now_);
}

void LineDriver::LookAtPort() {
  CountErrors();
  CheckSettings();
  if (listens_ && !config_.is_network()) look_at_ = now_.instant + kCountErrorsEvery;
}

/// ModemManager, brltty, a getty and stty do that, and each exchange fails from then on.
void LineDriver::CheckSettings() {
  const auto changes = port_.Restore();
  if (!changes) return;
  ++times_restored_;
  log::WarnFolded(config_.name + " restored",
                  "line {}: another program has changed the settings of {} ({}); they are set "
                  "again. Find it with 'baudgate ports'; docs/ports.md names the usual ones",
                  config_.name, config_.port, *changes);
  const auto times =
      times_restored_ == 1 ? std::string("once") : fmt::format("{} times", times_restored_);
  ShowPort(LineStatus::Port::open,
           fmt::format("{}; another program has changed its settings {}, last {} ({}); they were "
                       "set again",
                       port_.Describe(), times, FormatWallTime(now_.wall), *changes));
}

void LineDriver::CountErrors() {
  errors_counted_ = now_.instant;
  const PortCounters errors = port_.Counters();
  store_.UpdateLine(line_, [&](LineStatus& status) {
    status.parity_errors = errors.parity;
    status.framing_errors = errors.framing;
    status.overruns = errors.overrun;
    status.modem = port_.ReadModemLines();
  });
}

void LineDriver::CheckConnection() {
  // Where nobody is asked nothing comes, and where nobody answers it is not the connection's fault:
  // one that has held for long works.
  const bool old = now_.instant - opened_ >= kSilenceLimit;
  const bool unproven = connection_ != Connection::proven;
  if (unproven && (connection_ == Connection::heard || old)) Prove();
  if (!poller_.ledger().SilentSince(now_.instant - kSilenceLimit)) {
    check_at_ = now_.instant + kSilenceLimit / 4;
    return;
  }
  port_.Close();
  Lost("no device behind it has answered for " + FormatDuration(kSilenceLimit) +
       "; the connection is made anew");
}

// ---------------------------------------------------------------- the port, lent

void LineDriver::Release(Duration time, Now now) {
  now_ = now;
  if (stopping_) return;
  AfterTheWrite([this, time] { Lend(time); });
}

void LineDriver::TakeBack(Now now) {
  now_ = now;
  loan_.TakeBack("the line was taken back", now);
  EndLoan();
  Settle();
}

void LineDriver::AfterTheWrite(std::function<void()> then) {
  after_write_ = std::move(then);
  poller_.WindUp();
  patience_until_ = now_.instant + kPatience;
  Settle();
}

void LineDriver::GoOn() {
  patience_until_.reset();
  std::exchange(after_write_, {})();
}

void LineDriver::Lend(Duration time) {
  loan_.OnClosed("the port is released to another program", now_);
  lent_until_ = now_.instant + time;
  out_of_service_ = true;
  open_ = false;
  ClosePort();
  hand_.OnClosed("the port is lent to another program");
  poller_.OnClosed(now_, Quality::bad_out_of_service);
  log::Info({.line = config_.name}, "{} is released for {}; its points are out of service",
            config_.port, FormatDuration(time));
  const std::string text = "released for " + FormatDuration(time);
  ShowPort(LineStatus::Port::released, text, now_.wall + time);
  news_.Tell({News::What::port_lent, false, {}, text}, now_);
}

void LineDriver::EndLoan() {
  if (!lent_until_) return;
  lent_until_.reset();
  log::Info({.line = config_.name}, "takes {} back", config_.port);
  ShowPort(LineStatus::Port::closed, "being taken back");
  port_.Open();
}

// ---------------------------------------------------------------- the port, lent over the network

void LineDriver::Want(serial_server::PortUser& user, const serial_server::Visit& visit, Now now) {
  now_ = now;
  loan_.Want(user, visit, now);
  Settle();
}

void LineDriver::Return(serial_server::PortUser& user, const serial_server::Visit& visit,
                        const std::string& why, Now now) {
  now_ = now;
  loan_.Return(user, visit, why, now);
  Settle();
}

void LineDriver::Dismiss(serial_server::PortUser& user, const std::string& why, Now now) {
  now_ = now;
  loan_.Dismiss(user, why, now);
  Settle();
}

std::string LineDriver::WhyNot() const {
  if (stopping_) return "the gateway stops";
  if (lent_until_) return "the port is released to another program";
  return port_.is_open() ? std::string() : "the port is not open: " + shown_;
}

bool LineDriver::Quiet(Now) { return !hand_.is_busy() && poller_.Pause(); }

void LineDriver::OnLent(const std::string& text, WallTime until, Now now) {
  now_ = now;
  out_of_service_ = true;
  open_ = false;
  check_at_.reset();
  hand_.OnClosed("the port is lent to a client");
  poller_.OnClosed(now, Quality::bad_out_of_service);
  ShowPort(LineStatus::Port::released, text, until);
}

void LineDriver::OnReturned(Now now) {
  now_ = now;
  out_of_service_ = false;
  open_ = true;
  applied_ = &config_.serial;
  opened_ = now.instant;
  if (config_.is_network()) check_at_ = now.instant + kGreeting;
  ShowPort(LineStatus::Port::open, port_.Describe());
  poller_.OnOpened(now, port_.KeepsBitRate());
}

void LineDriver::OnPortFailed(const std::string& reason, Now now) {
  now_ = now;
  port_.Close();
  Lost(reason);
}

// ---------------------------------------------------------------- bytes, calls and time

void LineDriver::OnBytes(View bytes, Now now) {
  now_ = now;
  rest_.OnBytes();
  if (connection_ == Connection::fresh) connection_ = Connection::heard;
  if (connection_ == Connection::heard && now.instant - opened_ >= kGreeting) Prove();
  if (loan_.OnBytes(bytes, now)) return Settle();
  if (!hand_.OnBytes(bytes, now)) poller_.OnBytes(bytes, now);
  Settle();
}

void LineDriver::Send(View bytes, const config::SerialSettings& serial) {
  if (now_.instant - errors_counted_ >= kCountErrorsEvery) LookAtPort();
  if (&serial != applied_) {
    const Status status = port_.Apply(serial);
    if (!status) log::Warn({.line = config_.name}, "{}", status.error());
    applied_ = &serial;
  }
  if (!config_.is_network() || !rest_.Holds(bytes)) {
    port_.Send(bytes);
  } else {
    port_.Close();
    port_.Open();
  }
}

void LineDriver::Submit(WriteCommand command, Now now) {
  now_ = now;
  if (command.telegram) {
    hand_.Submit(std::move(command), open_, now);
    return Settle();
  }
  // Whoever hands commands over keeps to Poller::kQueueLimit, so the poller never says no.
  poller_.Submit(std::move(command), now);
  Settle();
}

void LineDriver::Submit(RoutedRequest request, Now now) {
  now_ = now;
  poller_.Submit(std::move(request), now);
  Settle();
}

void LineDriver::Forget(std::uint64_t client, Now now) {
  now_ = now;
  poller_.Forget(client, now);
  Settle();
}

void LineDriver::SetInUse(std::uint32_t device, bool in_use, Now now) {
  now_ = now;
  poller_.SetInUse(device, in_use, now);
  Settle();
}

void LineDriver::OnEventsKept(std::uint32_t device, const std::string& said, bool reported,
                              Now now) {
  now_ = now;
  if (reported) reported_.erase(device);
  if (reported_.count(device) > 0) return;
  poller_.OnEventsKept(device, said, now);
  Settle();
}

void LineDriver::OnTimer(Now now) {
  now_ = now;
  const auto is_due = [&](const std::optional<Instant>& at) { return at && *at <= now.instant; };
  if (is_due(patience_until_) && poller_.IsWriting()) {
    log::Warn({.line = config_.name},
              "a write is broken off; a password that it has opened may stay open");
    GoOn();
  }
  if (is_due(lent_until_)) EndLoan();
  if (is_due(check_at_)) CheckConnection();
  if (is_due(look_at_)) LookAtPort();
  if (is_due(loan_.Deadline())) loan_.OnTimer(now);
  if (is_due(hand_.Deadline())) hand_.OnTimer(now);
  if (is_due(poller_.Deadline())) poller_.OnTimer(now);
  Settle();
}

/// At the end of every input.
void LineDriver::Settle() {
  if (after_write_ && !poller_.IsWriting()) GoOn();
  if (!loan_.Settle(now_)) hand_.Settle(now_);
}

std::optional<Instant> LineDriver::Deadline() const {
  std::optional<Instant> soonest = poller_.Deadline();
  for (const auto& at :
       {check_at_, look_at_, lent_until_, patience_until_, hand_.Deadline(), loan_.Deadline()}) {
    if (at && (!soonest || *at < *soonest)) soonest = at;
  }
  return soonest;
}

// ---------------------------------------------------------------- news of devices

void LineDriver::OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                               const std::string& reason) {
  news_.OnDeviceState(device, from, to, reason, now_);
  log::About about{config_.name, std::string(recorder_.NameOf(device))};
  if (to == DeviceState::online) {
    log::Info(about, "{} (was {})", Name(to), Name(from));
  } else if (to == DeviceState::disabled || from == DeviceState::disabled) {
    log::Info(about, "{} (was {}): {}", Name(to), Name(from), reason);
  } else {
    const auto take = [&](const DeviceRecord& record) {
      about.outcome = Name(record.status.last_outcome);
    };
    if (device < kFirstSlave) store_.Read(device, take);  // a slave of a route stands in no store
    log::Warn(about, "{} (was {}): {}", Name(to), Name(from), reason);
  }
}

void LineDriver::OnWarning(std::uint32_t device, const std::string& message) {
  log::Warn({config_.name, std::string(recorder_.NameOf(device))}, "{}", message);
}

}  // namespace baudgate
