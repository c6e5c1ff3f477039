// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_reporter.h"

#include <fmt/format.h>

#include "gateway/base/log.h"
#include "gateway/base/outcome.h"
#include "gateway/bus/exchange/line.h"

namespace baudgate::lines {

void LineReporter::OnDeviceState(std::uint32_t device, bus::DeviceState from, bus::DeviceState to,
                                 const std::string& reason, Now at) {
  TellState(device, from, to, reason, at);
  log::About about{line_.name, std::string(recorder_.NameOf(device))};
  if (to == bus::DeviceState::online) {
    log::Info(about, "{} (was {})", Name(to), Name(from));
  } else if (to == bus::DeviceState::disabled || from == bus::DeviceState::disabled) {
    log::Info(about, "{} (was {}): {}", Name(to), Name(from), reason);
  } else {
    const auto take = [&](const bus::DeviceRecord& record) {
      about.outcome = Name(record.status.last_outcome);
    };
    // The store has no records of slaves that only transparent routes reach.
    if (device < bus::kFirstSlave) store_.Read(device, take);
    log::Warn(about, "{} (was {}): {}", Name(to), Name(from), reason);
  }
}

void LineReporter::OnWarning(std::uint32_t device, const std::string& message) {
  log::Warn({line_.name, std::string(recorder_.NameOf(device))}, "{}", message);
}

void LineReporter::TellState(std::uint32_t device, bus::DeviceState from, bus::DeviceState to,
                             const std::string& reason, Now at) {
  if (to == bus::DeviceState::disabled || from == bus::DeviceState::disabled) {
    OnNews({bus::News::What::not_in_use, to != bus::DeviceState::disabled, device, reason}, at);
  }
  if (to == bus::DeviceState::offline) {
    OnNews({bus::News::What::no_answer, false, device, reason}, at);
  } else if (Answers(to)) {
    OnNews({bus::News::What::no_answer, true, device}, at);
  }
}

void LineReporter::OnNews(bus::News news, Now at) {
  if (events_ == nullptr || retired_ || news.device >= bus::kFirstSlave) return;
  const auto key = std::pair(news.what, news.device);
  if (news.over) {
    news.first = lasting_.erase(key) == 0;
    const bool known = !over_.insert(key).second;
    if (news.first && known) return;
  } else if (news.what != bus::News::What::replaced) {
    const bool is_new = lasting_.insert(key).second;
    // A lasting state is reported once, except `wrong_device`, because its reason may have changed.
    if (!is_new && news.what != bus::News::What::wrong_device) return;
  }
  events_->OnNews(line_, news, at);
}

namespace {

/// Two connections count as equally old if their ages at their end differ by less than this plus a
/// tenth. Several equal ages show that the server limits how long a connection lasts.
constexpr Duration kSameAge = 500ms;

}  // namespace

PortDisplay::PortDisplay(bus::PointStore& store, const config::Line& line,
                         records::LineRecorder& recorder, LineReporter& reporter)
    : store_(store),
      line_(store.LineIndex(line)),
      name_(line.name),
      recorder_(recorder),
      reporter_(reporter) {}

void PortDisplay::OnOpened(const std::string& text, Now now) {
  log::Info({.line = name_}, "open ({})", text);
  Show(bus::LineStatus::Port::open, text, now);
  reporter_.OnNews({bus::News::What::port_down, true, {}, text}, now);
  reporter_.OnNews({bus::News::What::port_lent, true, {}, text}, now);
}

void PortDisplay::OnDown(const std::string& reason, Down down, Now now) {
  if (down.first) {
    log::Warn({.line = name_, .outcome = std::string(Name(Outcome::line_down))},
              "port down: {}; the gateway tries again until the port works", reason);
  }
  if (reason != text_) Show(bus::LineStatus::Port::closed, reason, now);
  Update([&](bus::LineStatus& status) { status.silent = down.silent; });
  reporter_.OnNews({bus::News::What::port_down, false, {}, reason}, now);
}

void PortDisplay::OnReleaseAsked(WallTime until) {
  Update([until](bus::LineStatus& status) { status.release_asked_until = until; });
}

void PortDisplay::OnReleased(const std::string& port, Duration time, Now now) {
  log::Info(
      {.line = name_},
      "{} is released for {} to another program; meanwhile the line's values are out of service",
      port, FormatDuration(time));
  const std::string text = "released for " + FormatDuration(time);
  OnReleaseAsked({});
  Show(bus::LineStatus::Port::released, text, now, {.until = now.wall + time});
  reporter_.OnNews({bus::News::What::port_lent, false, {}, text}, now);
}

void PortDisplay::OnTakenBack(Now now) {
  Show(bus::LineStatus::Port::closed, "being taken back", now);
  reporter_.OnNews({bus::News::What::port_lent, true}, now);
}

void PortDisplay::CountLoss(Now now, bool takes_no_data) {
  Update([&](bus::LineStatus& status) {
    ++status.times_lost;
    status.losses.Add(now.instant);
    status.takes_no_data = takes_no_data;
  });
}

void PortDisplay::CountNoConnection(transports::NoConnection why, Now now) {
  if (!std::exchange(worked_, false)) return;
  Update([&](bus::LineStatus& status) {
    if (why == transports::NoConnection::refused) status.ends.refused.Add(now.instant);
    if (why == transports::NoConnection::unreachable) status.ends.unreachable.Add(now.instant);
  });
}

void PortDisplay::CountEnd(End end, Now now) {
  const bool at_request = end.asked && !end.unread;
  const bool shut = worked_ && !end.worked && !at_request;
  worked_ = end.worked;
  Update([&](bus::LineStatus& status) {
    if (shut) status.ends.shut.Add(now.instant);
    if (end.asked && (end.worked || at_request)) status.ends.asked.Add(now.instant);
    if (end.worked && !end.asked) status.ends.idle.Add(now.instant);
    if (!end.worked) return;
    const Duration age = now.instant - connected_;
    const bool alike = std::chrono::abs(age - status.ends.age) < kSameAge + status.ends.age / 10;
    status.ends.alike = alike ? status.ends.alike + 1 : 1;
    status.ends.age = age;
  });
}

void PortDisplay::CountDrop(const std::string& reason, Now now) {
  Update([&](bus::LineStatus& status) { status.drops.Add(now.instant); });
  log::WarnFolded(
      name_ + " ended",
      "line {}: {} while the connection was in use; the next request opens the connection again",
      name_, reason);
}

void PortDisplay::CountRest() {
  Update([](bus::LineStatus& status) { ++status.rests; });
}

void PortDisplay::Show(bus::LineStatus::Port port, const std::string& text, Now now,
                       ShownLoan loan) {
  text_ = text;
  Update([&](bus::LineStatus& status) {
    if (status.port != port || status.port_text.empty()) status.port_since = now.wall;
    status.port = port;
    status.port_text = text;
    status.silent = false;
    status.released_until = loan.until;
    status.lent_to_client = loan.to_client;
  });
  recorder_.OnPort(fmt::format("port {}: {}", Name(port), text), now);
}

}  // namespace baudgate::lines
