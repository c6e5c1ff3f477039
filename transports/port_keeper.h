// Decides when a port that is absent, was lost or could not be opened is tried again: as soon as
// its device file appears or its rights change, else step by step, until it has
// worked. Used by the owner of the port's transport. ReopenLadder says when to try again, PortWatch
// when a port may have changed, and PortThread runs a port on a thread of its own.
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

// When a lost port is tried again: at once where its device file has just appeared, else in growing
// steps with jitter, so that many lines behind one dead server do not knock in step. The sixth of
// the named times. Time is an argument.
class ReopenLadder {
 public:
  static constexpr Duration kFirst = 500ms;
  static constexpr Duration kLast = 30s;

  explicit ReopenLadder(std::uint32_t seed) : random_(seed) {}

  /// The wait before the next try: 0.5 s, 1 s, 2 s … 30 s, each 10 % shorter or longer at random.
  Duration Next() {
    const Duration step = next_;
    next_ = std::min(2 * next_, kLast);
    std::uniform_real_distribution<double> jitter(0.9, 1.1);
    return Duration(static_cast<std::int64_t>(static_cast<double>(step.count()) * jitter(random_)));
  }
  /// The port has worked, or its file has appeared again.
  void Reset() { next_ = kFirst; }

 private:
  std::minstd_rand random_;
  Duration next_ = kFirst;
};

// Says when a port that is absent, or that could not be opened, may have changed: its device file
// or a link to it has appeared, or its rights have changed. Hears it from inotify and calls the
// line's owner.
class PortWatch {
 public:
  /// `on_change` is called from the loop, never from within a call. The io_context outlives the
  /// watch, which may be stopped from on_change, but not destroyed.
  PortWatch(asio::io_context& io, std::string port, std::function<void()> on_change);
  ~PortWatch() { Stop(); }
  PortWatch(const PortWatch&) = delete;
  PortWatch& operator=(const PortWatch&) = delete;

  /// Everything from now on is heard: look at the port after this, not before. False: this cannot
  /// be watched (a file system without such news, or no more watches): look from time to time.
  bool Start();
  void Stop();
  /// Started, and able to hear.
  bool watching() const { return running_ != nullptr; }

 private:
  struct WatchedFolder {
    int watch = -1;
    std::string name;  // of the entry in the watched folder that matters
  };
  bool Renew();
  bool WatchEntry(const std::filesystem::path& path);
  void Read();
  bool Matters(std::size_t size) const;

  const std::string port_;
  const std::function<void()> on_change_;
  asio::posix::stream_descriptor inotify_;
  std::shared_ptr<char> running_;  // gone = stopped
  std::vector<WatchedFolder> watched_;
  alignas(8) std::array<char, 4096> events_{};
};

/// What the owner of a port tells of it, so that it is opened again when that may help.
class PortRetries {
 public:
  virtual ~PortRetries() = default;
  /// A device file that opens works. A server does not: one that is taken accepts, and closes.
  virtual void OnOpened() = 0;
  /// The port has worked: tries start again at the first step, and every trouble is a new one.
  virtual void OnWorked() = 0;
  /// From now on the port is opened whenever that may help. Returns whether the trouble is news, so
  /// that one trouble is one line in the log: another than the one before, and with a server, whose
  /// refusals and losses take turns by chance, none since it last worked.
  [[nodiscard]] virtual bool OnDown(const std::string& reason) = 0;
  /// The port is opened no more, and the next trouble is a new one.
  virtual void Stop() = 0;
};

class PortKeeper final : public PortRetries {
 public:
  /// `open` is called from the loop, never from within a call. The io_context outlives the keeper,
  /// which may be stopped from `open`, but not destroyed. A `tcp://` port is never absent.
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
  std::shared_ptr<char> waiting_;  // gone = the timer's end means nothing
  std::set<std::string> told_;     // troubles
};

// A serial port with a thread of its own, for opening a sick driver may block it: then it blocks
// this thread, and not the clients of the Modbus server. What happens at the port goes to
// gateway/outputs/modbus/serial/serial_listener.cpp on the server's thread.

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

}  // namespace baudgate::transports
