// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/server.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <asio/ip/address.hpp>
#include <system_error>
#include <utility>

#include "gateway/base/fair_places.h"
#include "gateway/base/log.h"
#include "gateway/base/text.h"
#include "transports/listen_socket.h"

namespace baudgate::serial_server {
namespace {

/// The most bytes of one read: many, so that a fast client causes fewer calls.
constexpr std::size_t kReadAtMost = 16 * 1024;

std::string HowOf(const std::error_code& error) {
  if (error == asio::error::timed_out || error == asio::error::no_buffer_space) {
    return "it does not read what the port has received";
  }
  if (error == asio::error::connection_reset) return "it disconnected";
  return "its connection failed: " + error.message();
}

}  // namespace

ClientSocket::ClientSocket(tls::NetStream stream, Events events) {
  transports::KeepWatch(stream.native_handle());
  pump_ = std::make_shared<transports::StreamPump<tls::NetStream>>(
      std::move(stream), std::move(events.bytes),
      [end = std::move(events.end)](const std::error_code& error) {
        end(error != asio::error::eof, HowOf(error));
      },
      std::move(events.room), kStall, kReadAtMost);
}

ClientSocket::~ClientSocket() {
  pump_->Stop();
  std::error_code ignored;
  pump_->stream().close(ignored);
}

bool ClientSocket::HasLeft() {
  char byte = 0;
  return ::recv(pump_->stream().native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

namespace {

using asio::ip::tcp;

/// The pause before the next accept after an error. Without it, the loop would spin while file
/// descriptors or memory are used up.
constexpr Duration kAcceptPause = 100ms;
/// A waiting client that has sent this many bytes is no longer read until it has the port.
constexpr std::size_t kMostEarly = 4096;

/// Returns the address of a client; for an IPv4 client "::ffff:10.0.0.7" returns "10.0.0.7".
asio::ip::address AddressOf(const tcp::endpoint& peer) {
  const asio::ip::address address = peer.address();
  if (!address.is_v6() || !address.to_v6().is_v4_mapped()) return address;
  return asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6());
}

std::string NameOf(const tcp::endpoint& peer) {
  return HostAndPort(AddressOf(peer).to_string(), peer.port());
}

const char* KeyOf(Server::Use use) {
  if (use == Server::Use::by_hand) return "release --tcp";
  return use == Server::Use::served ? "serial_server.at" : "lend.at";
}

}  // namespace

Server::Server(asio::io_context& io, config::PortServer config, Use use, std::string line,
               PortOwner& owner)
    : config_(std::move(config)),
      use_(use),
      line_(std::move(line)),
      owner_(owner),
      io_(io),
      tls_(std::make_shared<tls::ContextFiles>(tls::End::server, config_.tls)),
      acceptor_(io),
      look_(io),
      retry_(io),
      timer_(io) {}

void Server::Start() {
  running_ = std::make_shared<char>();
  Look();
}

void Server::Look() {
  const bool was_open = acceptor_.is_open();
  const Status listens = was_open ? transports::HasAddressOf(acceptor_) : Listen();
  const std::string trouble = listens ? std::string() : listens.error();
  if (trouble != told_) {
    // The log announces no retries of `release --tcp`, because the user gets the error and the
    // server is stopped.
    const bool is_told = use_ == Use::by_hand;
    if (!trouble.empty()) {
      log::Warn({.line = line_}, "no client can connect at {}: {}{}", config_.Address(), trouble,
                is_told || was_open ? "" : ". The gateway tries again to open this address");
    } else {
      log::Info({.line = line_}, "clients can connect to the port at {} ({})", config_.Address(),
                Name(config_.mode));
    }
  }
  // A lasting trouble is reported each second, because a reload may remove it from the status.
  if (std::exchange(told_, trouble) != trouble || !trouble.empty()) {
    owner_.OnListening(config_.Address(), trouble, ReadClocks());
  }
  if (!was_open && listens) Accept();
  Later(look_, kTryEvery, &Server::Look);
}

Status Server::Listen() {
  if (config_.tls.on()) {
    if (const auto context = tls_->Current(); !context) return Error{context.error()};
  }
  asio::error_code failed;
  const auto address = asio::ip::make_address(config_.at.host, failed);
  if (failed) return Error{"not an IP address (names are not looked up)"};
  const tcp::endpoint endpoint(address, config_.at.port);
  return transports::Listen(acceptor_, endpoint, KeyOf(use_));
}

void Server::Stop() {
  running_.reset();
  told_.reset();
  asio::error_code ignored;
  acceptor_.close(ignored);
  look_.cancel();
  retry_.cancel();
  timer_.cancel();
  newcomers_.clear();
  holder_ = nullptr;
  clients_.clear();
}

void Server::Later(asio::steady_timer& timer, Duration wait, void (Server::*then)()) {
  timer.expires_after(wait);
  timer.async_wait([this, then, running = std::weak_ptr(running_)](const asio::error_code&) {
    if (!running.expired()) (this->*then)();
  });
}

void Server::Accept() {
  acceptor_.async_accept([this, running = std::weak_ptr(running_)](const asio::error_code& failed,
                                                                   tcp::socket socket) {
    if (running.expired()) return;
    if (failed && failed != asio::error::connection_aborted) {
      log::WarnFolded(line_ + " accept", "line {}: no client can be accepted at {}: {}", line_,
                      config_.Address(), failed.message());
      return Later(retry_, kAcceptPause, &Server::Accept);
    }
    if (!failed) Welcome(std::move(socket));
    Accept();
  });
}

std::optional<std::string> Server::WhyNot(const tcp::endpoint& peer) {
  const config::Network reach = config::ReachOf(AddressOf(peer).to_string());
  const bool allowed =
      config_.allow.empty() || std::ranges::any_of(config_.allow, [&](const auto& network) {
        return config::Covers(network, reach);
      });
  if (!allowed) return "its address is not in 'allow' of the line's serial_server or lend";
  const bool wait = use_ == Use::served && config_.busy == config::PortServer::Busy::wait;
  if (holder_ != nullptr && !wait && !IsSilent(*holder_)) {
    return "the port is in use by " + holder_->name;
  }
  if (clients_.size() >= kMostClients && !MakeRoom()) {
    return "too many clients are connected already; close a connection";
  }
  return std::nullopt;
}

/// True if the client has sent nothing for the port yet. It then must not keep a served port from
/// a client that sends.
bool Server::IsSilent(const Client& client) const {
  return client.session ? !client.session->asks() : client.early.empty();
}

/// Disconnects the oldest silent client. Returns false if there is none.
bool Server::MakeRoom() {
  const auto silent =
      std::ranges::find_if(clients_, [this](const Client& one) { return IsSilent(one); });
  if (silent == clients_.end()) return false;
  log::WarnFolded(line_ + " room",
                  "line {}: idle client {} is disconnected to make room for another", line_,
                  silent->name);
  Leave(*silent, "it sent nothing, and its place is needed for another client", ReadClocks());
  return true;
}

/// Disconnects the clients that wait for a served port. They were admitted while the client that
/// has the port was silent, and with `busy: refuse` no client waits.
void Server::RefuseWaiting(Now now) {
  if (use_ != Use::served || config_.busy == config::PortServer::Busy::wait) return;
  while (clients_.size() > 1) {
    Client& waiting = &clients_.front() == holder_ ? clients_.back() : clients_.front();
    Leave(waiting, "the port is in use by " + holder_->name, now);
  }
}

void Server::Welcome(tcp::socket socket) {
  asio::error_code gone;
  const tcp::endpoint peer = socket.remote_endpoint(gone);
  if (gone) return;
  if (config_.tls.on()) return BeginTls(std::move(socket), peer);
  if (!WhyNot(peer))
    owner_.OnArrival({.peer = NameOf(peer), .place = config_.Address()}, ReadClocks());
  Admit(tls::NetStream(std::move(socket)), peer);
}

void Server::Refuse(const tcp::endpoint& peer, const std::string& why) {
  log::WarnFolded(line_ + " refused " + HostOf(NameOf(peer)),
                  "line {}: client {} is refused at {}: {}", line_, NameOf(peer), config_.Address(),
                  why);
}

void Server::BeginTls(tcp::socket socket, const tcp::endpoint& peer) {
  if (const auto why = WhyNot(peer)) return Refuse(peer, *why);
  asio::error_code failed;
  const int owned = socket.release(failed);
  const std::uint64_t number = next_newcomer_++;
  newcomers_[number] = tls::Handshakes::OfProcess().Begin(
      owned, tls_, NameOf(peer), io_,
      [this, number, peer](Result<std::unique_ptr<tls::Channel>> result) {
        newcomers_.erase(number);
        owner_.OnArrival({.peer = NameOf(peer),
                          .place = config_.Address(),
                          .has_tls = true,
                          .who = result ? (*result)->peer().Name() : "",
                          .why_not = result ? "" : result.error()},
                         ReadClocks());
        if (!result) return Refuse(peer, result.error());
        tcp::socket secured = tls::SocketOf(**result, io_);
        Admit(tls::NetStream(std::move(secured), std::move(*result)), peer);
      });
}

void Server::Admit(tls::NetStream stream, const tcp::endpoint& peer) {
  const Now now = ReadClocks();
  // The arrival of a client may be reported before the departure of the client that had the port.
  if (holder_ != nullptr && holder_->socket->HasLeft()) OnEnd(*holder_, false, {});
  if (const auto why = WhyNot(peer)) return Refuse(peer, *why);
  Client& client = clients_.emplace_back();
  client.name = NameOf(peer);
  if (stream.channel() != nullptr && !stream.channel()->peer().serial.empty()) {
    client.name += " " + stream.channel()->peer().Name();
  }
  client.socket = std::make_unique<ClientSocket>(
      std::move(stream),
      ClientSocket::Events{
          .bytes = [this, &client](View bytes) { OnBytes(client, bytes); },
          .end = [this, &client](bool failed,
                                 const std::string& how) { OnEnd(client, failed, how); },
          .room =
              [&client] {
                if (client.session) client.session->OnClientRoom();
              }});
  client.socket->Start();
  if (use_ != Use::served) {
    BeginSession(client, now);
    Arm();
  } else if (holder_ == nullptr) {
    Want(client, now);
  }
}

void Server::BeginSession(Client& client, Now now) {
  client.session.emplace(
      Visit{.client = client.name, .place = config_.Address(), .mode = config_.mode, .began = now},
      config_.idle, "baudgate " + line_, *client.socket);
}

void Server::OnBytes(Client& client, View bytes) {
  const Now now = ReadClocks();
  if (!client.session) {
    Append(client.early, bytes);
    if (client.early.size() >= kMostEarly) client.socket->Pause(true);
    if (holder_ != nullptr && IsSilent(*holder_)) {
      Leave(*holder_, "it sent nothing, and " + client.name + " uses the port", now);
    }
    return;
  }
  client.session->OnClient(bytes, now);
  if (holder_ == &client && client.session->asks()) RefuseWaiting(now);
  if (client.session->asks() && !client.session->has_port() && holder_ != &client) {
    if (holder_ != nullptr) return Leave(client, "the port is in use by " + holder_->name, now);
    return Want(client, now);
  }
  Settle(client, now);
}

void Server::OnEnd(Client& client, bool failed, const std::string& how) {
  const Now now = ReadClocks();
  if (!failed && !client.session && !client.early.empty()) {
    client.has_ended = true;  // `early` is still sent to the port later
    return;
  }
  if (failed || !client.session) return Leave(client, failed ? how : "it disconnected", now);
  client.session->OnClientEnd(now);
  Settle(client, now);
}

/// Asks the owner for the port. The owner may call Grant or TakeBack before this call returns.
void Server::Want(Client& client, Now now) {
  holder_ = &client;
  if (!client.session) BeginSession(client, now);
  owner_.Want(*this, visit(), now);
  Arm();
}

void Server::Grant(transports::Transport& port, const config::SerialSettings& serial, Now now) {
  if (holder_ == nullptr) return;
  Client& client = *holder_;
  client.session->Begin(port, serial, now);
  if (const Bytes early = std::exchange(client.early, {}); !early.empty()) {
    client.socket->Pause(false);
    client.session->OnClient(early, now);
    RefuseWaiting(now);
  }
  if (client.has_ended) client.session->OnClientEnd(now);
  Arm();
}

void Server::TakeBack(Now now) {
  if (holder_ == nullptr) return;
  Remove(*holder_);
  AdmitNext(now);
}

void Server::OnPort(View bytes, Now now) {
  if (holder_ != nullptr) holder_->session->OnPort(bytes, now);
}

void Server::OnPortRoom() {
  if (holder_ != nullptr) holder_->session->OnPortRoom();
}

Visit Server::visit() const { return holder_ == nullptr ? Visit() : holder_->session->visit(); }

void Server::Settle(Client& client, Now now) {
  if (const auto why = client.session->over()) return Leave(client, *why, now);
  Arm();
}

void Server::Leave(Client& client, std::string why, Now now) {
  if (&client != holder_) {
    if (!client.early.empty()) {
      log::WarnFolded(
          line_ + " lost bytes " + HostOf(client.name),
          "line {}: the bytes that client {} sent while it waited for the port are lost: {}", line_,
          client.name, why);
    }
    return Remove(client);
  }
  const Visit its = visit();
  Remove(client);
  owner_.Return(*this, its, why, now);
  AdmitNext(now);
}

void Server::Remove(Client& client) {
  if (&client == holder_) holder_ = nullptr;
  clients_.remove_if([&client](const Client& one) { return &one == &client; });
}

void Server::AdmitNext(Now now) {
  if (use_ != Use::served || holder_ != nullptr || clients_.empty()) return;
  const auto sends =
      std::ranges::find_if(clients_, [this](const Client& one) { return !IsSilent(one); });
  Want(sends == clients_.end() ? clients_.front() : *sends, now);
}

/// Moves the timer only to an earlier deadline, because a timer that ends too early costs less than
/// setting it at every byte.
void Server::Arm() {
  Instant soonest = Instant::max();
  for (const Client& client : clients_) {
    if (client.session) soonest = std::min(soonest, *client.session->Deadline());
  }
  if (soonest >= armed_) return;
  armed_ = soonest;
  timer_.expires_at(armed_);
  timer_.async_wait([this, running = std::weak_ptr(running_)](const asio::error_code& error) {
    if (!error && !running.expired()) OnTimer();
  });
}

void Server::OnTimer() {
  armed_ = Instant::max();
  const Now now = ReadClocks();
  for (Client& client : clients_) {
    if (client.session) client.session->OnTimer(now);
  }
  const auto is_over = [](const Client& one) { return one.session && one.session->over(); };
  for (auto over = std::ranges::find_if(clients_, is_over); over != clients_.end();
       over = std::ranges::find_if(clients_, is_over)) {
    Leave(*over, *over->session->over(), now);
  }
  Arm();
}

}  // namespace baudgate::serial_server
