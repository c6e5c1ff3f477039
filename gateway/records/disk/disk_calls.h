// Calls that a disk may hold for ever. They run in order on a thread of their own, so that whoever
// needs their result waits for a limited time:
//
//   DiskCalls calls_{"configurations", 5s};
//   const auto written = calls_.Wait([=] { return kept.Write(texts); });  // empty: not in time
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/time.h"
#include "gateway/base/worker.h"

namespace baudgate {

class DiskCalls {
 public:
  /// `name`: of the thread.
  DiskCalls(std::string name, Duration patience);

  /// The result of `call`. Empty: it has not come within the patience. The call runs to its end
  /// anyway, so it owns what it uses.
  template <typename Call>
  auto Wait(Call call) -> std::optional<decltype(call())> {
    auto promise = std::make_shared<std::promise<decltype(call())>>();
    auto result = promise->get_future();
    const bool begun =
        Begin([promise, call = std::move(call)]() mutable { promise->set_value(call()); });
    if (!begun || result.wait_for(patience_) != std::future_status::ready) return std::nullopt;
    return result.get();
  }
  /// Runs `call` and does not wait for it. False: another call is under way, and this one is
  /// dropped.
  bool Offer(std::function<void()> call);

  /// Returns when all calls have ended. Idempotent; calls that come later are dropped.
  void Stop() { worker_.Stop(); }

 private:
  using Call = std::function<void()>;
  static constexpr std::size_t kMostWaiting = 16;

  bool Begin(Call call);

  const Duration patience_;
  std::atomic<int> pending_ = 0;  // calls that wait or run
  WorkQueue<Call> calls_{kMostWaiting};
  Worker worker_;
};

}  // namespace baudgate
