// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/session.h"

#include <utility>

namespace baudgate::serial_server {

Session::Session(Visit visit, Duration idle, std::string signature, Connection& connection)
    : visit_(std::move(visit)),
      idle_(idle),
      signature_(std::move(signature)),
      connection_(connection),
      heard_(visit_.began.instant) {
  if (is_telnet()) connection_.Send(telnet_.Begin());
}

// ---------------------------------------------------------------- from the client

void Session::OnClient(View bytes, Now now) {
  heard_ = now.instant;
  if (is_telnet()) {
    Decode(bytes, now);
  } else {
    Take(Kind::data, bytes, now);
  }
  Regulate();
}

void Session::Decode(View bytes, Now now) {
  for (;;) {
    Bytes answers;
    const auto part = telnet_.Next(bytes, answers);
    if (!answers.empty()) connection_.Send(answers);
    if (!part) return;
    Take(part->kind, part->bytes, now);
  }
}

void Session::Take(Kind kind, View bytes, Now now) {
  if (port_ == nullptr || break_at_) {
    asks_ = true;
    waiting_.push_back({kind, Bytes(bytes.begin(), bytes.end())});
  } else if (kind == Kind::break_key) {
    break_asked_ = now.instant;
    LookAtBreak(now);
  } else if (kind == Kind::command) {
    if (const Bytes answer = com_->On(bytes); !answer.empty()) connection_.Send(answer);
  } else {
    visit_.to_port += bytes.size();
    port_->Send(bytes);
  }
}

/// Up to the next break.
void Session::TakeWaiting(Now now) {
  while (!waiting_.empty() && !break_at_) {
    const Waiting one = std::move(waiting_.front());
    waiting_.pop_front();
    Take(one.kind, one.bytes, now);
  }
}

/// A port that makes no break, such as a pty, is not held up by one.
void Session::LookAtBreak(Now now) {
  if (std::exchange(breaks_, false)) {
    (void)com_->Break(false);
    break_at_.reset();
  } else if (!port_->IsDrained() && now.instant - break_asked_ < kMostBeforeBreak) {
    break_at_ = now.instant + kLookBeforeBreak;
  } else {
    breaks_ = com_->Break(true);
    break_at_ = breaks_ ? std::optional(now.instant + kBreakLasts) : std::nullopt;
  }
}

void Session::OnClientEnd(Now now) {
  if (drain_.has_begun()) return;
  drain_.Begin(now.instant);
  OnTimer(now);
}

// ---------------------------------------------------------------- the port

void Session::Begin(Transport& port, const config::SerialSettings& serial, Now now) {
  port_ = &port;
  visit_.began = now;
  heard_ = now.instant;
  if (is_telnet()) {
    com_.emplace(port, serial, signature_);
    look_at_ = now.instant + kLookEvery;
  }
  TakeWaiting(now);
  Regulate();
}

void Session::OnPort(View bytes, Now now) {
  heard_ = now.instant;
  visit_.from_port += bytes.size();
  if (is_telnet()) {
    Bytes escaped;
    escaped.reserve(bytes.size());
    AppendEscaped(escaped, bytes);
    connection_.Send(escaped);
  } else {
    connection_.Send(bytes);
  }
  Regulate();
}

void Session::End() {
  port_ = nullptr;
  com_.reset();
  look_at_.reset();
  break_at_.reset();
  breaks_ = false;
}

/// Each side is read as long as the other takes what comes of it.
void Session::Regulate() {
  const bool answers_wait = connection_.unsent() > kMostForClient;
  const bool pause_client =
      answers_wait || (port_ == nullptr ? asks_ : break_at_ || port_->Unsent() > kMostForPort);
  if (client_paused_ != pause_client) connection_.Pause(client_paused_ = pause_client);
  if (port_ == nullptr) return;
  const bool pause_port = answers_wait || (com_ && com_->suspended());
  if (port_paused_ != pause_port) port_->Pause(port_paused_ = pause_port);
}

// ---------------------------------------------------------------- time

void Session::OnTimer(Now now) {
  if (HasCome(break_at_, now.instant)) {
    LookAtBreak(now);
    TakeWaiting(now);
    Regulate();
  }
  if (HasCome(drain_.Deadline(), now.instant)) {
    const bool drained = waiting_.empty() && !break_at_ && (port_ == nullptr || port_->IsDrained());
    if (const auto why = drain_.Look(drained, now.instant)) over_ = why;
  }
  if (HasCome(look_at_, now.instant)) {
    look_at_ = now.instant + kLookEvery;
    if (const Bytes news = com_->Poll(); !news.empty()) connection_.Send(news);
  }
  if (!over_ && now.instant - heard_ >= idle_) {
    over_ = "nothing was said for " + FormatDuration(idle_);
  }
}

std::optional<Instant> Session::Deadline() const {
  return Soonest({heard_ + idle_, look_at_, break_at_, drain_.Deadline()});
}

}  // namespace baudgate::serial_server
