// A serial port with a thread of its own, for opening a sick driver may block it: then it blocks
// this thread, and not the clients of the Modbus server. What happens at the port goes to
// gateway/outputs/modbus/serial/serial_listener.cpp on the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "transports/loop_thread.h"
#include "transports/port_keeper.h"
#include "transports/transport.h"

namespace baudgate {

/// All its functions belong to the server's thread.
class PortThread final : private TransportListener {
 public:
  /// Called on the server's thread, in the order in which things happened.
  class Owner {
   public:
    virtual void OnOpened(const std::string& description) = 0;
    /// The port could not be opened, or is gone; `is_news` as PortKeeper::OnDown has it.
    virtual void OnDown(const std::string& reason, bool is_news) = 0;
    virtual void OnBytes(View bytes, Instant at) = 0;

   protected:
    ~Owner() = default;
  };
  using MakePort = std::function<std::unique_ptr<Transport>(asio::io_context&, TransportListener&)>;

  /// The server's io_context and the owner outlive the thread. Throws as LoopThread::Start does.
  PortThread(asio::io_context& server, const std::string& path, const MakePort& make, Owner& owner);
  ~PortThread() override { Stop(); }

  /// A port that is absent or cannot be opened is tried again until Stop.
  void Start();
  /// Waits for the driver while that blocks the thread. The owner is called no more.
  void Stop();
  /// Nothing happens while the port is closed.
  void Send(Bytes bytes);

 private:
  // On its own thread.
  void OnOpened() override;
  void OnOpenFailed(const std::string& reason) override { Down(reason); }
  void OnBytes(View bytes) override;
  void OnLost(const std::string& reason) override { Down(reason); }
  void Down(const std::string& reason);

  template <typename Call>
  void Tell(Call call) {
    asio::post(server_, [call = std::move(call), running = std::weak_ptr(running_)] {
      if (!running.expired()) call();
    });
  }

  asio::io_context& server_;
  Owner& owner_;
  LoopThread loop_{"modbus serial"};
  std::unique_ptr<Transport> port_;
  PortKeeper keeper_;                     // while the port is down
  std::atomic<std::size_t> unheard_ = 0;  // bytes on their way to the server's thread
  std::shared_ptr<char> running_;         // gone = stopped
};

}  // namespace baudgate
