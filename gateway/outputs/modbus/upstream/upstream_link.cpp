// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/upstream/upstream_link.h"

#include <asio/buffer.hpp>
#include <asio/connect.hpp>
#include <asio/error.hpp>
#include <asio/post.hpp>
#include <utility>

#include "transports/listen_socket.h"

namespace baudgate::modbus {

UpstreamQueue::Entry UpstreamQueue::Submit(bus::RoutedRequest request) {
  const MutexLock lock(mutex_);
  if (!open_ || !TakePlace(places_, request)) return Entry::refused;
  request.done = [this, host = request.host,
                  done = std::move(request.done)](bus::RoutedReply reply) {
    places_.Give(host);
    done(std::move(reply));
  };
  incoming_.push_back(std::move(request));
  return incoming_.size() == 1 ? Entry::first : Entry::more;
}

void UpstreamQueue::Open() {
  const MutexLock lock(mutex_);
  open_ = true;
}

bool UpstreamQueue::Gather() {
  const MutexLock lock(mutex_);
  if (!open_) return false;
  QueueIncoming();
  return true;
}

bool UpstreamQueue::Close() {
  const MutexLock lock(mutex_);
  if (!open_) return false;
  open_ = false;
  QueueIncoming();
  return true;
}

void UpstreamQueue::QueueIncoming() {
  for (bus::RoutedRequest& request : incoming_) Push(std::move(request));
  incoming_.clear();
}

namespace {

using asio::ip::tcp;

}  // namespace

void UpstreamConnection::Open(const std::string& host, std::uint16_t port,
                              std::shared_ptr<tls::ContextFiles> tls) {
  host_ = host;
  tls_ = std::move(tls);
  asio::error_code not_numeric;
  const auto address = asio::ip::make_address(host, not_numeric);
  if (!not_numeric) return Connect({tcp::endpoint(address, port)});
  look_up_ = transports::HostNames::OfProcess().Ask(
      host, io_,
      [self = shared_from_this(), port](const Result<transports::HostNames::Addresses>& found) {
        if (self->owner_ == nullptr) return;
        if (!found)
          return self->owner_->OnBroken("has a name that cannot be resolved: " + found.error());
        std::vector<tcp::endpoint> endpoints;
        for (const asio::ip::address& ip : *found) endpoints.emplace_back(ip, port);
        self->Connect(endpoints);
      });
}

void UpstreamConnection::Connect(const std::vector<tcp::endpoint>& endpoints) {
  connecting_ = std::make_unique<tcp::socket>(io_);
  asio::async_connect(
      *connecting_, endpoints,
      [self = shared_from_this()](const asio::error_code& error, const tcp::endpoint&) {
        if (self->owner_ == nullptr) return;
        if (error) return self->owner_->OnBroken("cannot be reached: " + error.message());
        transports::KeepWatch(self->connecting_->native_handle());
        if (self->tls_) return self->BeginTls();
        self->stream_ = tls::NetStream(std::move(*self->connecting_));
        self->Begin();
      });
}

void UpstreamConnection::BeginTls() {
  asio::error_code failed;
  const int owned = connecting_->release(failed);
  handshake_ = tls::Handshakes::OfProcess().Begin(
      owned, tls_, host_, io_,
      [self = shared_from_this()](Result<std::unique_ptr<tls::Channel>> result) {
        if (self->owner_ == nullptr) return;
        if (!result) return self->owner_->OnBroken("cannot be called over TLS: " + result.error());
        tcp::socket socket = tls::SocketOf(**result, self->io_);
        self->stream_ = tls::NetStream(std::move(socket), std::move(*result));
        self->Begin();
      });
}

void UpstreamConnection::Begin() {
  asio::error_code failed;
  stream_.non_blocking(true, failed);
  if (failed) return owner_->OnBroken("cannot be used: " + failed.message());
  connected_ = true;
  Read();
  owner_->OnConnected();
}

/// If the kernel has no space for a few hundred bytes, the server does not read, so this is an
/// error. Bytes are not queued here, because they would be sent after their deadlines.
Status UpstreamConnection::Send(View frame) {
  asio::error_code error;
  const std::size_t count = stream_.write_some(asio::buffer(frame.data(), frame.size()), error);
  if (error && error != asio::error::would_block)
    return Error{"has lost the connection: " + error.message()};
  if (count < frame.size()) return Error{"takes no data"};
  return {};
}

void UpstreamConnection::Close() {
  owner_ = nullptr;
  look_up_ = {};
  handshake_ = {};
  asio::error_code ignored;
  if (connecting_) connecting_->close(ignored);
  // Closes with a reset, so that neither kernel later delivers a request that was reported to a
  // client as lost.
  stream_.Reset();
}

void UpstreamConnection::Read() {
  const auto space = input_.Space();
  stream_.async_read_some(
      asio::buffer(space.data(), space.size()),
      [self = shared_from_this()](const asio::error_code& error, std::size_t count) {
        if (self->owner_ == nullptr) return;
        if (error == asio::error::eof) return self->owner_->OnBroken("closed the connection");
        if (error) return self->owner_->OnBroken("has lost the connection: " + error.message());
        self->input_.Commit(count);
        self->TakeFrames();
      });
}

void UpstreamConnection::TakeFrames() {
  View frame;
  while (input_.Take(frame) == MbapAssembler::State::frame) {
    owner_->OnFrame(frame);
    if (owner_ == nullptr) return;
  }
  const std::string defect(input_.Defect());
  if (!defect.empty()) return owner_->OnBroken("sent something that is not Modbus TCP: " + defect);
  Read();
  owner_->OnFramesRead();
}

}  // namespace baudgate::modbus
