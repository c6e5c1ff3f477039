// SPDX-License-Identifier: Apache-2.0
#include "gateway/serial_server/session.h"

#include <utility>

#include "gateway/base/deadline.h"

namespace baudgate::serial_server {

using Mode = config::PortServer::Mode;

Session::Session(Mode mode, Duration idle, std::string signature, Connection& connection, Now now)
    : mode_(mode),
      idle_(idle),
      signature_(std::move(signature)),
      connection_(connection),
      began_(now),
      heard_(now.instant) {
  if (mode_ == Mode::rfc2217) connection_.Send(options_.Begin());
}

// ---------------------------------------------------------------- from the client

void Session::OnClient(View bytes, Now now) {
  heard_ = now.instant;
  if (mode_ == Mode::raw) {
    Take(false, bytes);
  } else {
    Decode(bytes);
  }
  Regulate();
}

void Session::Decode(View bytes) {
  while (const auto item = decoder_.Next(bytes)) {
    switch (item->what) {
      case TelnetItem::What::data:
        Take(false, item->bytes);
        break;
      case TelnetItem::What::negotiation:
        if (const Bytes answer = options_.On(item->verb, item->option); !answer.empty()) {
          connection_.Send(answer);
        }
        // A program for serial ports sends bytes, not lines of text.
        if (options_.theirs(telnet::kBinary) || options_.theirs(telnet::kComPort)) {
          decoder_.SetBinary();
        }
        break;
      case TelnetItem::What::subnegotiation:
        if (item->option == telnet::kComPort) Take(true, item->bytes);
        break;
    }
  }
}

void Session::Take(bool is_command, View bytes) {
  if (port_ == nullptr) {
    asks_ = true;
    waiting_.push_back({is_command, Bytes(bytes.begin(), bytes.end())});
  } else if (is_command) {
    if (const Bytes answer = com_->On(bytes); !answer.empty()) connection_.Send(answer);
  } else {
    to_port_ += bytes.size();
    port_->Send(bytes);
  }
}

void Session::OnClientEnd(Now now) {
  if (drains_since_) return;
  drains_since_ = now.instant;
  drained_at_ = now.instant;
  OnTimer(now);
}

// ---------------------------------------------------------------- the port

void Session::Begin(Transport& port, const config::SerialSettings& serial, Now now) {
  port_ = &port;
  began_ = now;
  heard_ = now.instant;
  if (mode_ == Mode::rfc2217) {
    com_.emplace(port, serial, signature_);
    look_at_ = now.instant + kLookEvery;
  }
  for (const Waiting& one : std::exchange(waiting_, {})) Take(one.is_command, one.bytes);
  Regulate();
}

void Session::OnPort(View bytes, Now now) {
  heard_ = now.instant;
  from_port_ += bytes.size();
  if (mode_ == Mode::raw) {
    connection_.Send(bytes);
  } else {
    Bytes escaped;
    escaped.reserve(bytes.size());
    AppendEscaped(escaped, bytes);
    connection_.Send(escaped);
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
  if (HasCome(drained_at_, now.instant)) {
    drained_at_ = now.instant + kDrainEvery;
    if (port_ == nullptr ? waiting_.empty() : port_->IsDrained()) over_ = "it has left";
    if (now.instant - *drains_since_ >= kLongestDrain) {
      over_ = "it has left, and the port did not take all that it had sent";
    }
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
  return Soonest({heard_ + idle_, look_at_, drained_at_});
}

}  // namespace baudgate::serial_server
