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
// that many lines behind one dead server do not connect at the same moment. Time is an argument.
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
  /// Restarts with the first wait. To be called when the port has worked, or its file has appeared.
  void Reset() { next_ = kFirst; }

 private:
  std::minstd_rand random_;
  Duration next_ = kFirst;
};

// PortWatch reports when a port that is absent, or could not be opened, may have changed: its
// device file or a link to it has appeared, or its rights have changed. It uses inotify.
class PortWatch {
 public:
  /// `on_change` is called from the loop, never inside a call to this object. The io_context must
  /// outlive the watch. on_change may stop the watch, but not destroy it.
  PortWatch(asio::io_context& io, std::string port, std::function<void()> on_change);
  ~PortWatch() { Stop(); }
  PortWatch(const PortWatch&) = delete;
  PortWatch& operator=(const PortWatch&) = delete;

  /// Starts the watch. Check the port after this call, so that no change is lost. False: the port
  /// cannot be watched (unsuitable file system, or no watches left), so the caller must check
  /// periodically.
  bool Start();
  void Stop();
  /// True if started and still able to report changes.
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
  std::shared_ptr<char> running_;  // null: stopped
  std::vector<WatchedFolder> watched_;
  alignas(8) std::array<char, 4096> events_{};
};

/// The owner of a port reports the port's state here, so that the port is opened again when it may
/// succeed.
class PortRetries {
 public:
  virtual ~PortRetries() = default;
  /// The port has been opened. A device file then counts as working. A server does not: if it is in
  /// use, it accepts the connection and closes it.
  virtual void OnOpened() = 0;
  /// Data has been exchanged: the next attempts begin with the first wait, and every reason counts
  /// as new.
  virtual void OnWorked() = 0;
  /// The port is down; from now on it is opened whenever that may succeed. Returns true if `reason`
  /// should be logged because it is new: for a device file, if it differs from the previous one;
  /// for a server, if it has not occurred since the server last worked, because refusals and losses
  /// alternate there.
  [[nodiscard]] virtual bool OnDown(const std::string& reason) = 0;
  /// Stops the attempts to open the port; the next reason counts as new.
  virtual void Stop() = 0;
};

class PortKeeper final : public PortRetries {
 public:
  /// `open` is called from the loop, never inside a call to this object. The io_context must
  /// outlive the keeper. `open` may stop the keeper, but not destroy it. A `tcp://` port is never
  /// absent.
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
  std::shared_ptr<char> waiting_;  // null: the running timer has no effect
  std::set<std::string> told_;     // reasons that OnDown has returned as new
};

// PortThread runs a serial port on its own thread, because a faulty driver may block it for a long
// time; so the clients of the Modbus server are not blocked. Events of the port go to
// gateway/outputs/modbus/serial/serial_listener.cpp on the server's thread.

/// All its public functions must be called on the server's thread.
class PortThread final : private TransportListener {
 public:
  /// Callbacks, called on the server's thread in the order of the events.
  class Owner {
   public:
    virtual void OnOpened(const std::string& description) = 0;
    /// The port could not be opened, or is lost; `is_news` is the result of PortKeeper::OnDown.
    virtual void OnDown(const std::string& reason, bool is_news) = 0;
    virtual void OnBytes(View bytes, Instant at) = 0;

   protected:
    ~Owner() = default;
  };
  using MakePort = std::function<std::unique_ptr<Transport>(asio::io_context&, TransportListener&)>;

  /// The server's io_context and the owner must outlive this object. Throws as LoopThread::Start
  /// does.
  PortThread(asio::io_context& server, const std::string& path, const MakePort& make, Owner& owner);
  ~PortThread() override { Stop(); }

  /// Opens the port; retries until Stop if the port is absent or cannot be opened.
  void Start();
  /// Stops; blocks as long as the driver blocks the port's thread. No callback comes afterwards.
  void Stop();
  /// Sends `bytes`; drops them while the port is closed.
  void Send(Bytes bytes);

 private:
  // Called on the port's thread.
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
  PortKeeper keeper_;                     // used while the port is down
  std::atomic<std::size_t> unheard_ = 0;  // bytes on their way to the server's thread
  std::shared_ptr<char> running_;         // null: stopped
};

}  // namespace baudgate::transports
