// The number of a line for as long as the gateway runs, and the line itself, if there still is one:
// a caller need not know whether a reload has ended it. All calls from any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include "gateway/base/guarded.h"
#include "gateway/bus/writes/routed.h"
#include "gateway/lines/line_runner.h"

namespace baudgate {

class LineSlot final : public RouteTarget {
 public:
  /// Why a request for it ends while there is no line.
  static constexpr const char* kNotThere = "its line does not run: a reload adds or has removed it";

  bool Submit(RoutedRequest request) override {
    bool taken = true;
    const bool there = With([&](LineRunner& runner) { taken = runner.Submit(std::move(request)); });
    if (!there) request.done({Outcome::line_down, {}, kNotThere});
    return taken;
  }
  void Abandon(std::uint64_t client) override {
    Post([client](LineParts& line, Now now) { line.poller.Abandon(client, now); });
  }

  /// Calls `call` with the line, which stays until it returns; false: there is none.
  template <typename Call>
  bool With(Call call) const {
    const MutexLock lock(mutex_);
    if (!runner_) return false;
    call(*runner_);
    return true;
  }

  /// Calls `call` with the parts of the line and the time on its loop, soon, if there is a line.
  template <typename Call>
  void Post(Call call) const {
    With([&](LineRunner& runner) { runner.Post(std::move(call)); });
  }

  /// For gateway/lines/lines.cpp, which puts and takes it; null: there is none.
  LineRunner* mine() const {
    const MutexLock lock(mutex_);
    return runner_.get();
  }
  void Put(std::unique_ptr<LineRunner> runner) {
    const MutexLock lock(mutex_);
    runner_ = std::move(runner);
  }
  /// No call reaches the line after this.
  std::unique_ptr<LineRunner> Take() {
    const MutexLock lock(mutex_);
    return std::move(runner_);
  }

 private:
  mutable Mutex mutex_;
  std::unique_ptr<LineRunner> runner_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate
