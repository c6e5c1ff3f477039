// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/port_loan.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "gateway/base/fair_places.h"
#include "gateway/base/log.h"
#include "gateway/records/audit/audited_writes.h"

namespace baudgate::lines {

using serial_server::PortUser;
using serial_server::Visit;

namespace {

/// After this time a client gets the port even if the current exchange has not ended. An exchange
/// lasts that long only if a device sends without end.
constexpr Duration kLongestWait = 10s;
constexpr Duration kShowEvery = 1s;
/// After a loan, the line waits at most this long for silence on the bus (State::rests).
constexpr Duration kLongestRest = 10s;
/// Between two loans the line polls for this time. Otherwise a client that comes again and again
/// would have the port without limit.
constexpr Duration kPolls = 5s;

std::string WhoOf(const Visit& visit) {
  return fmt::format("{} at {}, {}", visit.client, visit.place, Name(visit.mode));
}

std::string TookText(Duration took) {
  if (took >= 10s) return FormatDuration(std::chrono::floor<std::chrono::seconds>(took));
  return FormatDuration(std::chrono::floor<std::chrono::milliseconds>(took));
}

std::string BytesOf(const Visit& visit) {
  return fmt::format("{} bytes to the port, {} from it", visit.to_port, visit.from_port);
}

}  // namespace

void PortLoan::Want(PortUser& user, const Visit& visit, Now now) {
  std::optional<std::string> why_not = line_.WhyNot();
  if (!why_not) why_not = InUse();
  if (!why_not && lends() && links_.records.required && links_.records.log != nullptr &&
      !links_.records.log->Trouble().empty()) {
    why_not = "the audit cannot record the loan (audit: require): " + links_.records.log->Trouble();
  }
  if (why_not) return Refuse(user, visit.client, *why_not, now);
  user_ = &user;
  visit_ = visit;
  if (state_ == State::rests) return;
  if (now.instant < polls_until_) {
    state_ = State::waits;
  } else {
    Await(now);
  }
}

void PortLoan::Refuse(PortUser& user, const std::string& client, const std::string& why_not,
                      Now now) {
  log::WarnFolded(links_.config.name + " wanted", "line {}: client {} does not get the port: {}",
                  links_.config.name, client, why_not);
  user.TakeBack(now);
}

std::optional<std::string> PortLoan::InUse() const {
  if (user_ == nullptr) return std::nullopt;
  return "the port is in use by " + visit_.client;
}

void PortLoan::Await(Now now) {
  state_ = State::wanted;
  wanted_at_ = now.instant;
  Settle(now);
}

bool PortLoan::Settle(Now now) {
  const bool late = now.instant - wanted_at_ >= kLongestWait;
  if (state_ == State::wanted && (line_.Quiet() || late)) HandOver(now);
  return state_ == State::wanted;
}

Duration PortLoan::TimeOf(const Visit& visit, Now now) const {
  if (visit.place == offered_at_) return offered_until_ - now.instant;
  return links_.config.lend ? links_.config.lend->time : config::PortServer().time;
}

void PortLoan::HandOver(Now now) {
  if (const auto why_not = line_.WhyNot()) {  // the port was closed while the client waited
    PortUser& user = *user_;
    Part();
    return Refuse(user, visit_.client, *why_not, now);
  }
  Status set = links_.port.Reset(links_.config.serial);
  if (set) set = links_.port.PassOn();
  if (!set) return line_.OnPortFailed(set.error(), now);
  state_ = State::held;
  show_at_ = heard_ = now.instant;
  visit_.began = now;
  const std::string who = WhoOf(visit_);
  if (lends()) {
    const Duration time = std::chrono::ceil<std::chrono::seconds>(TimeOf(visit_, now));
    until_ = now.instant + time;
    line_.OnLent("lent to " + who, now.wall + time, now);
    links_.news.OnNews({bus::News::What::port_lent, false, {}, who}, now);
    if (links_.records.log != nullptr) {
      audit::BeginLoan(
          *links_.records.log, {links_.config.name, visit_.client, now},
          fmt::format("at {}, {}, for {}", visit_.place, Name(visit_.mode), FormatDuration(time)));
    }
  } else {
    until_ = Instant::max();
    links_.news.OnNews({bus::News::What::port_served, false, {}, who}, now);
  }
  log::InfoFolded({.line = links_.config.name},
                  links_.config.name + " has port " + HostOf(visit_.client),
                  "client {} has the port", who);
  PortUser& user = *user_;
  user.Grant(links_.port, links_.config.serial, now);
  if (user_ != nullptr) ShowVisit(now);
}

/// Forgets the client that asks for the port or has it. Returns true if the client had the port.
bool PortLoan::Part() {
  user_ = nullptr;
  const bool held = state_ == State::held;
  if (state_ != State::rests) state_ = State::free;
  return held;
}

void PortLoan::Return(PortUser& user, const Visit& visit, const std::string& why, Now now) {
  if (user_ != &user || !Part()) return;
  Tell(visit, why, now);
  Restore(now);
}

void PortLoan::TakeBack(const std::string& why, Now now) {
  if (Dismiss(why, now) && user_ == nullptr) Restore(now);
}

void PortLoan::OnClosed(const std::string& reason, Now now) {
  if (state_ == State::rests) state_ = State::free;
  // Sets the settings of the line, so that the next program that opens the port finds them.
  if (Dismiss(reason, now)) (void)links_.port.Reset(links_.config.serial);
}

/// Disconnects the client that asks for the port or has it. Returns true if the client had the
/// port.
bool PortLoan::Dismiss(const std::string& why, Now now) {
  if (user_ == nullptr) return false;
  PortUser& user = *user_;
  const Visit visit = user.visit();
  const bool held = Part();
  if (held) Tell(visit, why, now);
  user.TakeBack(now);
  return held;
}

/// Reports to log, audit, events and status that a client no longer has the port.
void PortLoan::Tell(const Visit& visit, const std::string& why, Now now) {
  const Duration took = now.instant - visit.began.instant;
  const std::string text = fmt::format("{}, after {}; {}", why, TookText(took), BytesOf(visit));
  log::InfoFolded({.line = links_.config.name},
                  links_.config.name + " had port " + HostOf(visit.client),
                  "client {} no longer has the port: {}", visit.client, text);
  if (lends() && links_.records.log != nullptr) {
    audit::EndLoan(*links_.records.log, {links_.config.name, visit.client, visit.began},
                   why + "; " + BytesOf(visit), now);
  }
  const auto what = lends() ? bus::News::What::port_lent : bus::News::What::port_served;
  links_.news.OnNews({what, true, {}, visit.client + ": " + text}, now);
  links_.store.UpdateLine(number_, [&](bus::LineStatus& status) {
    bus::PortService* const service = ServiceAt(status, visit.place);
    if (service == nullptr) return;
    service->visit = bus::PortService::Visit{visit.client,  visit.began.wall, now.wall,
                                             visit.to_port, visit.from_port,  why};
  });
}

/// Restores the settings of the port. A line that polls then waits until the bus is silent
/// (State::rests). A port that is only served is free for the next client at once.
void PortLoan::Restore(Now now) {
  if (const Status set = links_.port.Reset(links_.config.serial); !set) {
    return line_.OnPortFailed(set.error(), now);
  }
  if (!lends()) return;
  state_ = State::rests;
  heard_ = now.instant;
  until_ = now.instant + kLongestRest;
  OnTimer(now);
}

bool PortLoan::PassToClient(View bytes, Now now) {
  if (state_ != State::held && state_ != State::rests) return !lends();
  heard_ = now.instant;
  if (state_ == State::held && user_ != nullptr) user_->OnPort(bytes, now);
  return true;
}

void PortLoan::OnRoom() {
  if (state_ == State::held && user_ != nullptr) user_->OnPortRoom();
}

void PortLoan::OnTimer(Now now) {
  if (state_ == State::held && until_ <= now.instant) {
    TakeBack("the time of the loan is over", now);
  }
  if (state_ == State::held && show_at_ <= now.instant) ShowVisit(now);
  if (state_ == State::rests && (heard_ + links_.rest <= now.instant || until_ <= now.instant)) {
    state_ = user_ == nullptr ? State::free : State::waits;
    polls_until_ = now.instant + kPolls;
    line_.OnReturned(now);
  }
  if (state_ == State::waits && polls_until_ <= now.instant) Await(now);
}

std::optional<Instant> PortLoan::Deadline() const {
  switch (state_) {
    case State::free:
      return std::nullopt;
    case State::waits:
      return polls_until_;
    case State::wanted:
      return wanted_at_ + kLongestWait;
    case State::held:
      return std::min(until_, show_at_);
    case State::rests:
      return std::min(until_, heard_ + links_.rest);
  }
  return std::nullopt;
}

void PortLoan::ShowVisit(Now now) {
  show_at_ = now.instant + kShowEvery;
  const Visit visit = user_->visit();
  const transports::PortCounters errors = links_.port.Counters();
  const WallTime until = until_ == Instant::max() ? WallTime{} : now.wall + (until_ - now.instant);
  links_.store.UpdateLine(number_, [&](bus::LineStatus& status) {
    status.parity_errors = errors.parity;
    status.framing_errors = errors.framing;
    status.overruns = errors.overrun;
    status.modem = links_.port.ReadModemLines();
    bus::PortService* const service = ServiceAt(status, visit.place);
    if (service == nullptr) return;
    service->visit = bus::PortService::Visit{visit.client,  visit.began.wall, until,
                                             visit.to_port, visit.from_port,  {}};
  });
}

bus::PortService* PortLoan::ServiceAt(bus::LineStatus& status, const std::string& place) const {
  const auto found = std::ranges::find(status.services, place, &bus::PortService::place);
  return found == status.services.end() ? nullptr : &*found;
}

void PortLoan::OnArrival(const Arrival& arrival, Now now) {
  audit::SecurityJournal* const journal = links_.records.journal;
  if (journal == nullptr) return;
  const std::string port = "port of line " + links_.config.name + " at " + arrival.place;
  if (arrival.why_not.empty()) journal->NoteHost(arrival.peer, port, now.wall);
  if (!arrival.has_tls) return;
  journal->Note({"login", arrival.who, HostOf(arrival.peer), port,
                 arrival.why_not.empty() ? "ok" : arrival.why_not},
                now.wall);
}

void PortLoan::OnListening(const std::string& place, const std::string& trouble, Now /*now*/) {
  links_.store.UpdateLine(number_, [&](bus::LineStatus& status) {
    if (bus::PortService* const service = ServiceAt(status, place)) service->trouble = trouble;
  });
}

void PortLoan::Offer(const config::PortServer& server, Duration time, Now now) {
  offered_at_ = server.Address();
  offered_until_ = now.instant + time;
  // A user wants the port to be lent now, so the next client need not wait for polls.
  polls_until_ = now.instant;
  ShowService(server, now.wall + time);
}

void PortLoan::Withdraw(const config::PortServer& server) {
  offered_at_.clear();
  HideService(server.Address());
}

void PortLoan::HideService(const std::string& place) {
  links_.store.UpdateLine(number_, [&](bus::LineStatus& status) {
    std::erase_if(status.services, [&](const bus::PortService& one) { return one.place == place; });
  });
}

/// `until`: the end of the offer; nothing: the server exists as long as the line.
void PortLoan::ShowService(const config::PortServer& server, std::optional<WallTime> until) {
  HideService(server.Address());
  bus::PortService service;
  service.place = server.Address();
  service.mode = Name(server.mode);
  service.lent = lends();
  service.trouble = "not opened yet";
  if (until) service.open_until = *until;
  links_.store.UpdateLine(
      number_, [&](bus::LineStatus& status) { status.services.push_back(std::move(service)); });
}

}  // namespace baudgate::lines
