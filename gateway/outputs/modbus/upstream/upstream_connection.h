// One connection to a Modbus TCP server: look-up, connecting, whole frames in and out. Made and
// heard by upstream.cpp, which knows what the frames mean.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/outputs/modbus/wire/mbap.h"
#include "transports/host_names.h"

namespace baudgate::modbus {

/// All on the thread that runs the io_context. Kept alive by its own pending operations.
class UpstreamConnection : public std::enable_shared_from_this<UpstreamConnection> {
 public:
  /// The listener, never called from within a call. May close the connection from within a
  /// callback.
  class Owner {
   public:
    virtual void OnConnected() = 0;
    /// Everything that has come together; called for each frame, then OnFramesRead.
    virtual void OnFrame(View frame) = 0;
    virtual void OnFramesRead() = 0;
    /// The length of a frame that begins with `head`: see MbapAssembler::Length.
    virtual std::size_t LengthOf(View head, std::size_t told) const = 0;
    /// Not to be used any more. `reason` goes on where the server's name ends.
    virtual void OnBroken(const std::string& reason) = 0;

   protected:
    ~Owner() = default;
  };

  /// The owner outlives the connection until Close.
  UpstreamConnection(asio::io_context& io, Owner& owner)
      : io_(io), socket_(io), owner_(&owner), input_([this](View head, std::size_t told) {
          return owner_ == nullptr ? told : owner_->LengthOf(head, told);
        }) {}

  /// Once. Takes as long as it takes; Close ends it.
  void Open(const std::string& host, std::uint16_t port);
  /// Hands the whole frame to the kernel; an error when that is not possible now.
  Status Send(View frame);
  /// No callback from now on. What neither side has read is dropped, not delivered late.
  void Close();

  bool connected() const { return connected_; }
  /// A frame has begun to come.
  bool in_frame() const { return !input_.empty(); }
  /// Its transaction id, if that much of it has come.
  std::optional<std::uint16_t> frame_id() const { return input_.transaction(); }

 private:
  void Connect(const std::vector<asio::ip::tcp::endpoint>& endpoints);
  void Begin();
  void Read();
  void TakeFrames();

  asio::io_context& io_;
  HostNames::Ticket look_up_;
  asio::ip::tcp::socket socket_;
  Owner* owner_;  // null: closed
  bool connected_ = false;
  MbapAssembler input_;
};

}  // namespace baudgate::modbus
