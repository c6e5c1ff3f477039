// `LoopThread` is an event loop with its own thread: one for each port whose driver may block, and
// one for many lines that never block. All handlers of io() run on this thread.
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

/// Runs `call` on the thread of `io` and waits until it has returned. The loop must be running, and
/// the caller must be on another thread.
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
  /// `name` is the thread's name in `top -H`; the kernel keeps 15 bytes. Nothing runs before Start.
  explicit LoopThread(std::string name);
  ~LoopThread() { Stop(); }
  LoopThread(const LoopThread&) = delete;
  LoopThread& operator=(const LoopThread&) = delete;

  /// Objects that use io() must end before this object, or after Stop.
  asio::io_context& io() { return io_; }
  /// Starts the thread; a second call has no effect. Like the constructor, throws std::system_error
  /// if the system has no threads or file descriptors left.
  void Start();
  /// Runs the handlers that are queued already, then `last`, stops the loop, and waits for its end.
  /// May be called from any thread but the loop's own.
  void Stop(std::function<void()> last = {});

 private:
  void Run();

  const std::string name_;
  asio::io_context io_{1};
  // Allocates the loop's descriptors now, not at the first real timer.
  asio::steady_timer first_{io_};
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  std::thread thread_;
};

}  // namespace baudgate::transports
