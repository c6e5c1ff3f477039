// `LoopThread` is an event loop (io_context) with a thread of its own. A port whose driver can
// block has a LoopThread of its own; lines that never block share one. All handlers of io() run on
// the thread.
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
  /// `name` is the name of the thread in `top -H`, cut to 15 bytes. Handlers run only after Start.
  explicit LoopThread(std::string name);
  ~LoopThread() { Stop(); }
  LoopThread(const LoopThread&) = delete;
  LoopThread& operator=(const LoopThread&) = delete;

  /// Objects that use io() must be destroyed before this LoopThread.
  asio::io_context& io() { return io_; }
  /// Starts the thread; a second call has no effect. Start and the constructor throw
  /// std::system_error if the system has no threads or file descriptors left.
  void Start();
  /// Runs the handlers that are queued already, then `last`, and waits until the thread has ended.
  /// Must not be called on this thread.
  void Stop(std::function<void()> last = {});

 private:
  void Run();

  const std::string name_;
  asio::io_context io_{1};
  // This timer never runs. It makes asio open its file descriptors now, not at the first real one.
  asio::steady_timer first_{io_};
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  std::thread thread_;
};

}  // namespace baudgate::transports
