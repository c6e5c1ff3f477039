// SPDX-License-Identifier: Apache-2.0
#include "gateway/serial_server/session.h"

#include <utility>

#include "gateway/base/deadline.h"

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
    Decode(bytes);
  } else {
    Take(false, bytes);
  }
  Regulate();
}

void Session::Decode(View bytes) {
  for (;;) {
    Bytes answers;
    const auto part = telnet_.Next(bytes, answers);
    if (!answers.empty()) connection_.Send(answers);
    if (!part) return;
    Take(part->is_command, part->bytes);
  }
}

void Session::Take(bool is_command, View bytes) {
  if (port_ == nullptr) {
    asks_ = true;
    waiting_.push_back({is_command, Bytes(bytes.begin(), bytes.end())});
  } else if (is_command) {
    if (const Bytes answer = com_->On(bytes); !answer.empty()) connection_.Send(answer);
  } else {
    visit_.to_port += bytes.size();
    port_->Send(bytes);
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
  for (const Waiting& one : std::exchange(waiting_, {})) Take(one.is_command, one.bytes);
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
}

/// Each side is read as long as the other takes what comes of it.
void Session::Regulate() {
  const bool answers_wait = connection_.unsent() > kMostForClient;
  const bool pause_client =
      answers_wait || (port_ == nullptr ? asks_ : port_->Unsent() > kMostForPort);
  if (client_paused_ != pause_client) connection_.Pause(client_paused_ = pause_client);
  if (port_ == nullptr) return;
  const bool pause_port = answers_wait || (com_ && com_->suspended());
  if (port_paused_ != pause_port) port_->Pause(port_paused_ = pause_port);
}

// ---------------------------------------------------------------- time

void Session::OnTimer(Now now) {
  if (HasCome(drain_.Deadline(), now.instant)) {
    const bool drained = port_ == nullptr ? waiting_.empty() : port_->IsDrained();
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
  return Soonest({heard_ + idle_, look_at_, drain_.Deadline()});
}

}  // namespace baudgate::serial_server
