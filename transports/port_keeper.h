// `PortKeeper` decides when to open a port again that is absent, was lost or could not be opened:
// as soon as its device file appears or its rights change, else after growing waits, until the port
// has worked. The owner of the port's transport uses it. ReopenLadder computes the waits, PortWatch
// reports changes of the device file, and PortThread runs a port on its own thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "transports/loop_thread.h"
#include "transports/transport.h"

namespace baudgate::transports {

// ReopenLadder computes the waits between attempts to open a port. They grow and have jitter, so
// that many lines behind one dead server do not connect at the same moment.
class ReopenLadder {
 public:
  static constexpr Duration kFirst = 500ms;
  static constexpr Duration kLast = 30s;

  explicit ReopenLadder(std::uint32_t seed) : random_(seed) {}

  /// Returns the wait before the next attempt: 0.5 s, 1 s, 2 s … 30 s, each changed by up to 10 %
  /// at random.
  Duration Next() {
    const Duration step = next_;
    next_ = std::min(2 * next_, kLast);
    std::uniform_real_distribution<double> jitter(0.9, 1.1);
    return Duration(static_cast<std::int64_t>(static_cast<double>(step.count()) * jitter(random_)));
  }
  /// Makes the next wait the shortest again, because the port has worked or its file has appeared.
  void Reset() { next_ = kFirst; }

 private:
  std::minstd_rand random_;
  Duration next_ = kFirst;
};

// PortWatch reports when it is worth opening an unusable port again, because its device file or a
// link to the file has appeared, or its rights have changed. It uses inotify.
class PortWatch {
 public:
  /// `on_change` is called from the loop, never inside a call to this object. It is allowed to stop
  /// the watch, but must not destroy it. The io_context must outlive the watch.
  PortWatch(asio::io_context& io, std::string port, std::function<void()> on_change);
  ~PortWatch() { Stop(); }
  PortWatch(const PortWatch&) = delete;
  PortWatch& operator=(const PortWatch&) = delete;

  /// Starts the watch. The caller must check the port after this call, so that no change is lost.
  /// Returns false if the port cannot be watched (unsuitable file system, or no watches left); the
  /// caller must then check the port periodically.
  bool Start();
  void Stop();
  bool watching() const { return running_ != nullptr; }

 private:
  struct WatchedFolder {
    int watch = -1;
    std::string name;  // entry in the watched folder whose changes are reported
  };
  bool Renew();
  bool WatchEntry(const std::filesystem::path& path);
  void Read();
  bool Matters(std::size_t size) const;

  const std::string port_;
  const std::function<void()> on_change_;
  asio::posix::stream_descriptor inotify_;
  std::shared_ptr<char> running_;  // null: stopped, so a pending read has no effect
  std::vector<WatchedFolder> watched_;
  alignas(8) std::array<char, 4096> events_{};
};

/// The owner of a port calls PortRetries to report the port's state, so that the port is opened
/// again when this can succeed.
class PortRetries {
 public:
  virtual ~PortRetries() = default;
  /// Reports that the port has been opened. A device file then counts as working. A connection to a
  /// serial server does not, because a server that is in use accepts it and then closes it.
  virtual void OnOpened() = 0;
  /// Reports that data was exchanged. The next wait is short again, and OnDown takes any reason as
  /// new.
  virtual void OnWorked() = 0;
  /// Reports that the port is down; it is then opened again at suitable times. Returns true if
  /// `reason` should be logged because it is new. For a device file, a reason is new if it differs
  /// from the previous reason. For a server, it is new if it has not occurred since the server last
  /// worked, because refusals and losses alternate there.
  [[nodiscard]] virtual bool OnDown(const std::string& reason) = 0;
  /// Stops the attempts to open the port; the next reason counts as new.
  virtual void Stop() = 0;
};

class PortKeeper final : public PortRetries {
 public:
  /// `open` is called from the loop, never inside a call to this object. It is allowed to stop the
  /// keeper, but must not destroy it. The io_context must outlive the keeper. A `tcp://` port never
  /// counts as absent.
  PortKeeper(asio::io_context& io, std::string port, std::function<void()> open);
  PortKeeper(const PortKeeper&) = delete;
  PortKeeper& operator=(const PortKeeper&) = delete;

  void OnOpened() override;
  void OnWorked() override { Stop(); }
  [[nodiscard]] bool OnDown(const std::string& reason) override;
  void Stop() override;

 private:
  void Try();
  void TryIn(Duration wait);
  void OnPortChange();
  bool IsMissing() const;

  const std::string port_;
  const bool network_;
  const std::function<void()> open_;
  asio::steady_timer timer_;
  PortWatch watch_;
  ReopenLadder ladder_;
  std::shared_ptr<char> waiting_;  // null: no attempt is planned, so timer_ has no effect
  std::set<std::string> told_;     // reasons that OnDown has returned as new
};

// PortThread runs a serial port on its own thread, so that a faulty driver that blocks for a long
// time does not block the clients of the Modbus server. Events of the port go to
// gateway/outputs/modbus/serial/serial_listener.cpp on the server's thread.

/// All public functions of PortThread must be called on the server's thread.
class PortThread final : private TransportListener {
 public:
  /// The functions of Owner are called on the server's thread, in the order of the events.
  class Owner {
   public:
    virtual void OnOpened(const std::string& description) = 0;
    /// The port could not be opened, or is lost. `is_news`: `reason` is new and should be logged.
    virtual void OnDown(const std::string& reason, bool is_news) = 0;
    virtual void OnBytes(View bytes, Instant at) = 0;

   protected:
    ~Owner() = default;
  };
  using MakePort = std::function<std::unique_ptr<Transport>(asio::io_context&, TransportListener&)>;

  /// The server's io_context and the owner must outlive this object. Throws std::system_error if
  /// the system has no threads or file descriptors left.
  PortThread(asio::io_context& server, const std::string& path, const MakePort& make, Owner& owner);
  ~PortThread() override { Stop(); }

  /// Opens the port. Opens it again until Stop, whenever it is absent, fails to open or is lost.
  void Start();
  /// Closes the port and ends its thread. Waits as long as the driver blocks. Afterwards no
  /// function of Owner is called.
  void Stop();
  /// Sends `bytes`; drops them while the port is closed.
  void Send(Bytes bytes);

 private:
  // The functions of TransportListener are called on the port's thread.
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
  PortKeeper keeper_;
  // The number of received bytes that the server's thread has not yet taken.
  std::atomic<std::size_t> unheard_ = 0;
  std::shared_ptr<char> running_;  // null: stopped, so Tell has no effect
};

}  // namespace baudgate::transports
