// An event loop with a thread of its own: for ports whose driver may block, and for many lines that
// never block. Everything that is made on io() runs on this thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>

namespace baudgate::transports {

// Something done on the thread of a loop, for a thread that waits for it.

/// The loop runs, and this is not its thread.
template <typename Call>
void RunOn(asio::io_context& io, Call call) {
  const auto done = std::make_shared<std::promise<void>>();
  asio::post(io, [done, &call] {
    call();
    done->set_value();
  });
  done->get_future().wait();
}

class LoopThread {
 public:
  /// `name` as `top -H` shows it; the kernel keeps 15 bytes. Nothing runs before Start.
  explicit LoopThread(std::string name);
  ~LoopThread() { Stop(); }
  LoopThread(const LoopThread&) = delete;
  LoopThread& operator=(const LoopThread&) = delete;

  /// What uses it ends before this object does, or after Stop.
  asio::io_context& io() { return io_; }
  /// Again: nothing. Throws std::system_error, as the constructor does, where the system has no
  /// threads or file descriptors left.
  void Start();
  /// Runs what is queued already, then `last`, then nothing any more, and waits for that; from any
  /// thread but the loop's own.
  void Stop(std::function<void()> last = {});

 private:
  void Run();

  const std::string name_;
  asio::io_context io_{1};
  asio::steady_timer first_{io_};  // takes the loop's descriptors now, not at the first real timer
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  std::thread thread_;
};

}  // namespace baudgate::transports
