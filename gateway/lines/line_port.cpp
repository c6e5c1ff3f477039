// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_port.h"

#include <fmt/format.h>

#include "gateway/base/log.h"
#include "gateway/lines/line_control.h"
#include "transports/serial_settings.h"

namespace baudgate::lines {
namespace {

/// SettingsWatch checks the port at most this often, because each check calls into the driver.
constexpr Duration kLookEvery = 1s;

}  // namespace

void SettingsWatch::OnOpened(Now now) {
  applied_ = line_.serial;
  times_restored_ = 0;
  Look(now);
}

void SettingsWatch::OnSend(const config::SerialSettings& serial, Now now) {
  if (now.instant - looked_ >= kLookEvery) Look(now);
  if (transports::SameSettings(serial, applied_)) return;
  const Status status = port_.Apply(serial);
  if (!status) {
    log::WarnFolded(line_.name + " settings",
                    "line {}: {}; the gateway tries again before the next request", line_.name,
                    status.error());
    return;
  }
  applied_ = serial;
}

void SettingsWatch::OnTimer(Now now) {
  if (due_ && *due_ <= now.instant) Look(now);
}

void SettingsWatch::Look(Now now) {
  looked_ = now.instant;
  CountErrors();
  CheckSettings(now);
  if (listens_) due_ = now.instant + kLookEvery;
}

void SettingsWatch::CountErrors() {
  const transports::PortCounters errors = port_.Counters();
  display_.Update([&](bus::LineStatus& status) {
    status.parity_errors = errors.parity;
    status.framing_errors = errors.framing;
    status.overruns = errors.overrun;
    status.modem = port_.ReadModemLines();
  });
}

void SettingsWatch::CheckSettings(Now now) {
  const auto changes = port_.Restore();
  if (!changes) return;
  ++times_restored_;
  display_.Update([this](bus::LineStatus& status) {
    status.restored = static_cast<std::uint32_t>(times_restored_);
  });
  log::WarnFolded(
      line_.name + " restored",
      "line {}: another program has changed the settings of {} ({}); the gateway has set them "
      "again. Find the program with 'baudgate ports'; docs/ports.md names the usual ones",
      line_.name, line_.port, *changes);
  const auto times =
      times_restored_ == 1 ? std::string("once") : fmt::format("{} times", times_restored_);
  display_.Show(bus::LineStatus::Port::open,
                fmt::format("{}; another program has changed its settings {}, last at {} ({}), and "
                            "the gateway has set them again",
                            port_.Describe(), times, FormatWallTime(now.wall), *changes),
                now);
}

namespace {

/// A server that has left this many requests unanswered has probably passed them to its devices.
constexpr int kPassedOn = 2;

/// Calls the timer of `part`, a Poller or a TelegramQueue, until none is due. Several can be due if
/// the program was suspended: one ends the exchange, the next sends the next request.
void CatchUp(auto& part, Now now) {
  constexpr int kMostSteps = 100;
  for (int i = 0; i < kMostSteps && HasCome(part.Deadline(), now.instant); ++i) part.OnTimer(now);
}

/// Returns what the user should check if a connection ended before ConnectionProof had proven it.
std::string HintOf(const RestingConnection& rest, bool unread, const config::Line& line) {
  const std::string& protocol = line.protocol;
  if (rest.unanswered() >= kPassedOn) {
    return "with requests unanswered: check the server's mode (raw TCP), its protocol (" +
           protocol +
           "), its inactivity time, and the power, wire and address of the devices behind it";
  }
  if (rest.asks() && !unread) {
    const config::Traits& traits =
        line.devices.empty() ? config::kNoTraits : *line.devices.front().traits;
    const std::string other(traits.counterpart);
    if (!traits.service.empty()) {
      return "before any good reply, after the first request: check that " +
             std::string(traits.service) +
             " is behind this port, serves this unit, and admits the gateway's address";
    }
    return "before any good reply, after the first request: the server expects another protocol. "
           "Set its port to raw TCP for " +
           protocol +
           (other.empty() ? "" : ", or set protocol: " + other + " in the configuration") +
           "; check the port number";
  }
  return "before any good reply: check whether another client uses the server, and its connection "
         "limit";
}

}  // namespace

LinePort::LinePort(const config::Line& line, bus::PointStore& store,
                   transports::Transport& transport, transports::PortRetries& retries,
                   records::LineRecorder& recorder, LineReporter& reporter, bus::Poller& poller,
                   TelegramQueue& telegrams, PortLoan& loan, bool listens, std::size_t transaction)
    : line_(line),
      transport_(transport),
      retries_(retries),
      poller_(poller),
      telegrams_(telegrams),
      loan_(loan),
      display_(store, line, recorder, reporter),
      settings_(line, transport, display_, listens),
      proof_(line.is_network()),
      resting_(listens, transaction) {}

void LinePort::Start(Now now) {
  now_ = now;
  if (lent_until_ || stopping_) return;
  display_.Show(bus::LineStatus::Port::closed, std::string(kNotOpenedYet), now);
  transport_.Open();
}

void LinePort::Stop(const std::string& why, Now now, std::function<void()> stopped) {
  now_ = now;
  stopping_ = why;
  lent_until_.reset();
  loan_.OnClosed(why, now);
  AfterTheWrite([this, stopped = std::move(stopped)] {
    ClosePort();
    telegrams_.OnClosed(*stopping_);
    if (open_.exchange(false)) poller_.OnClosed(now_);
    stopped();
  });
}

/// Closes the port and stops the retries, so that nothing opens the port again.
void LinePort::ClosePort() {
  proof_.OnClosed();
  settings_.OnClosed();
  retries_.Stop();
  resting_.End();
  transport_.Close();
}

void LinePort::OnOpened(Now now) {
  now_ = now;
  display_.OnConnected(now);
  if (resting_.OnOpened(poller_.accounts().line.Answers(), now.instant)) {
    DropLate();
    if (const Bytes request = resting_.TakeHeld(); !request.empty()) transport_.Send(request);
    return;
  }
  open_ = true;
  out_of_service_ = false;
  retries_.OnOpened();
  if (proof_.OnOpened(now.instant)) display_.OnOpened(transport_.Describe(), now);
  settings_.OnOpened(now);
  poller_.OnOpened(now, transport_.KeepsBitRate());
}

/// Drops the request that waits for this connection if its exchange has ended, for example while
/// the program was suspended, or if it is too late to send the request.
void LinePort::DropLate() {
  CatchUp(telegrams_, now_);
  CatchUp(poller_, now_);
  if (!telegrams_.MayGoOut(now_) || !poller_.MayGoOut(now_)) resting_.GiveUpHeld();
}

void LinePort::Prove() {
  retries_.OnWorked();
  display_.OnWorked();
  if (proof_.TakeNews()) display_.OnOpened(transport_.Describe(), now_);
}

void LinePort::OnOpenFailed(const std::string& reason, transports::NoConnection why, Now now) {
  now_ = now;
  display_.CountNoConnection(why, now);
  if (resting_.rests()) {
    display_.CountLoss(now);
    return Lost(reason);
  }
  // The loan to another program is over, but its port cannot be opened, so its points stay bad.
  if (std::exchange(out_of_service_, false)) poller_.OnClosed(now);
  display_.OnDown(reason, {.first = retries_.OnDown(reason)}, now_);
}

void LinePort::OnLost(const std::string& reason, Now now, bool takes_no_data) {
  now_ = now;
  display_.CountLoss(now, takes_no_data);
  Lost(reason);
}

void LinePort::OnEnded(const std::string& reason, bool unread, Now now) {
  now_ = now;
  const std::uint64_t answers = poller_.accounts().line.Answers();
  const bool several = line_.devices.size() > 1;
  // While a client uses the port, the line sends no request that would open the connection again.
  const bool lent = loan_.has_port();
  display_.CountEnd(
      {.worked = resting_.HasWorked(answers), .asked = resting_.asks(), .unread = unread}, now);
  if (!lent && resting_.IsDrop(answers, now.instant)) display_.CountDrop(reason, now);
  if (lent || !resting_.OnEnded(answers, several, now.instant)) {
    display_.CountLoss(now);
    return Lost(reason, unread ? Loss::unread : Loss::port);
  }
  if (!resting_.in_vain() && proof_.Prove()) Prove();
  display_.CountRest();
  poller_.OnEnded(now);
}

void LinePort::Lost(const std::string& reason, Loss loss) {
  open_ = false;
  const std::string hint = HintOf(resting_, loss == Loss::unread, line_);
  resting_.End();
  settings_.OnClosed();
  telegrams_.OnClosed("the port was lost");
  loan_.OnClosed("the port is lost: " + reason, now_);
  poller_.OnClosed(now_);
  const std::string shown = proof_.OnLost() ? reason : reason + ", " + hint;
  display_.OnDown(shown, {.first = retries_.OnDown(shown), .silent = loss == Loss::silence}, now_);
}

void LinePort::CheckConnection() {
  constexpr Duration kLimit = ConnectionProof::kSilenceLimit;
  const bool silent = poller_.accounts().line.SilentSince(now_.instant - kLimit);
  if (proof_.OnCheck(now_.instant, silent)) Prove();
  if (!silent) return;
  transport_.Close();
  Lost("no device behind the server has answered for " + FormatDuration(kLimit) +
           "; the gateway connects again",
       Loss::silence);
}

void LinePort::Release(Duration time, Now now) {
  now_ = now;
  if (stopping_) return;
  display_.OnReleaseAsked(now.wall + time);
  AfterTheWrite([this, time] { Lend(time); });
}

void LinePort::EndRelease(Now now) {
  now_ = now;
  loan_.TakeBack(std::string(kTakenBack), now);
  if (grace_.waits() && !stopping_) {  // the port has not been lent yet
    grace_.CallOff();
    display_.OnReleaseAsked({});
    poller_.CallOffWindUp(now);
  }
  EndLoan();
}

void LinePort::AfterTheWrite(std::function<void()> then) {
  poller_.WindUp();
  grace_.Begin(std::move(then), now_.instant);
}

void LinePort::Lend(Duration time) {
  lent_until_ = now_.instant + time;
  loan_.OnClosed("the port is lent to another program", now_);
  out_of_service_ = true;
  open_ = false;
  ClosePort();
  telegrams_.OnClosed("the port is lent to another program");
  poller_.OnClosed(now_, Quality::bad_out_of_service);
  display_.OnReleased(line_.port, time, now_);
}

void LinePort::EndLoan() {
  if (!lent_until_) return;
  lent_until_.reset();
  log::Info({.line = line_.name}, "takes {} back", line_.port);
  display_.OnTakenBack(now_);
  transport_.Open();
}

std::optional<std::string> LinePort::WhyNot() const {
  if (stopping_) return stopping_;
  if (lent_until_) return "the port is lent to another program";
  if (resting_.rests())
    return "the server has closed the connection; the next request opens it again";
  if (!transport_.is_open()) return "the port is not open: " + display_.text();
  return std::nullopt;
}

bool LinePort::Quiet() { return !telegrams_.is_busy() && poller_.Pause(now_); }

void LinePort::OnLent(const std::string& text, WallTime until, Now now) {
  now_ = now;
  out_of_service_ = true;
  open_ = false;
  proof_.Pause();
  telegrams_.OnClosed("the port is lent to a client");
  poller_.OnClosed(now, Quality::bad_out_of_service);
  display_.Show(bus::LineStatus::Port::released, text, now, {.until = until, .to_client = true});
}

void LinePort::OnReturned(Now now) {
  now_ = now;
  out_of_service_ = false;
  open_ = true;
  settings_.OnReturned();
  proof_.GoOn(now.instant);
  display_.Show(bus::LineStatus::Port::open, transport_.Describe(), now);
  poller_.OnOpened(now, transport_.KeepsBitRate());
}

void LinePort::OnPortFailed(const std::string& reason, Now now) {
  now_ = now;
  transport_.Close();
  Lost(reason);
}

void LinePort::PassOn(View bytes, Now now) {
  now_ = now;
  resting_.NoteBytes(now.instant);
  if (proof_.NoteBytes(now.instant)) Prove();
  if (loan_.PassToClient(bytes, now)) return;
  if (!telegrams_.TakeBytes(bytes, now)) poller_.Receive(bytes, now);
}

void LinePort::Send(View bytes, const config::SerialSettings& serial, Now now) {
  settings_.OnSend(serial, now);
  if (!line_.is_network() || !resting_.Holds(bytes, now.instant)) {
    transport_.Send(bytes);
  } else {
    transport_.Close();
    transport_.Open();
  }
}

void LinePort::DropUnsent() {
  resting_.GiveUpHeld();
  transport_.DropUnsent();
}

void LinePort::OnTimer(Now now) {
  now_ = now;
  if (grace_.IsOver(now.instant) && poller_.IsWriting()) {
    log::Warn({.line = line_.name},
              "a write was aborted, so the device may still be unlocked by its password; write "
              "again, or lock it at the device");
    grace_.End();
  }
  if (HasCome(lent_until_, now.instant)) EndLoan();
  if (HasCome(proof_.check_at(), now.instant)) CheckConnection();
  settings_.OnTimer(now);
}

void LinePort::Settle(Now now) {
  now_ = now;
  if (grace_.waits() && !poller_.IsWriting()) grace_.End();
}

std::optional<Instant> LinePort::Deadline() const {
  return Soonest({proof_.check_at(), settings_.Deadline(), lent_until_, grace_.until()});
}

}  // namespace baudgate::lines
