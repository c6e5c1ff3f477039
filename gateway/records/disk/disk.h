// These types handle a disk that contains files of the state folder: its condition, the checks of
// its files, and calls that it can delay without end.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/base/worker.h"

namespace baudgate::records {

enum class Disk : std::uint8_t {
  opening,
  fine,
  stalled,  ///< the disk does not answer in time
  failing,
};
std::string_view Name(Disk disk);

// `DiskCondition` stores what is wrong with the disk of a log (audit, events or history), and since
// when. No lock, no clock: the logs provide these.
//
//   Set(fine)                       nothing new
//   Set(stalled, "does not answer") begun
//   Set(failing, "it is full")      nothing new: the trouble goes on
//   Set(fine)                       ended: "it is full"
//
class DiskCondition {
 public:
  explicit DiskCondition(WallTime since) : since_(since) {}

  struct Past {
    std::string trouble;
    WallTime since{};
  };
  struct News {
    bool begun = false;
    std::optional<Past> ended{};
  };
  News Set(Disk disk, std::string trouble, WallTime now) {
    const WallTime since = since_;
    if (std::exchange(disk_, disk) != disk) since_ = now;
    std::string was = std::exchange(trouble_, std::move(trouble));
    if (was.empty()) return {.begun = !trouble_.empty()};
    if (!trouble_.empty()) return {};
    return {.ended = Past{std::move(was), since}};
  }

  bool is_fine() const { return disk_ == Disk::fine; }
  bool is_opening() const { return disk_ == Disk::opening; }
  bool is_stalled() const { return disk_ == Disk::stalled; }
  bool is_failing() const { return disk_ == Disk::failing; }
  bool holds_up() const { return is_stalled() || is_failing(); }
  const std::string& trouble() const { return trouble_; }

  void SetPutAside(std::vector<std::string> files) { put_aside_ = std::move(files); }
  const std::vector<std::string>& put_aside() const { return put_aside_; }

  template <typename State>
  void Fill(State& state) const {
    state.disk = disk_;
    state.trouble = trouble_;
    state.since = since_;
  }

 private:
  Disk disk_ = Disk::opening;
  std::string trouble_;
  WallTime since_;
  std::vector<std::string> put_aside_;
};

// `FileWatch` decides when the file of a log must be checked although nothing is written to it, and
// when its disk does not answer in time. No thread, no lock, no clock: the log calls Tick once a
// second.
class FileWatch {
 public:
  /// The disk does not answer in time if a record waits, or a write is under way, at more than this
  /// number of ticks in a row.
  static constexpr int kMostTicks = 3;
  static constexpr int kLookEvery = 10;  ///< ticks between two checks of the file

  /// `waits`: a record has to be written. Returns true if the disk does not answer in time.
  bool Tick(bool waits) {
    ++ticks_;
    look_ = look_ || ticks_ % kLookEvery == 0;
    waited_ = waits || writing_ ? waited_ + 1 : 0;
    return waited_ > kMostTicks;
  }
  bool look_due() const { return look_; }

  struct Look {
    bool due = false;
    bool whole = false;
  };
  Look TakeLook() {
    const Look look{look_, look_ && doubt_};
    if (look.whole) doubt_ = false;
    look_ = false;
    return look;
  }
  /// To be called when a reader has found damage: the next check reads the whole file.
  void Doubt() { doubt_ = true; }

  /// The writing thread calls Begin before a write and End after it; it can hang between them.
  void Begin() { writing_ = true; }
  void End() {
    writing_ = false;
    waited_ = 0;
  }

 private:
  int ticks_ = 0;
  int waited_ = 0;
  bool look_ = false;
  bool doubt_ = false;
  bool writing_ = false;
};

// `DiskCalls` makes calls that a disk can delay without end. The calls run in order on one separate
// thread, so that the caller waits for a limited time:
//
//   DiskCalls calls_{"configurations", 5s};
//   const auto written = calls_.Wait([=] { return kept.Write(texts); });  // empty: not in time
//
class DiskCalls {
 public:
  DiskCalls(std::string name, Duration patience);

  /// Returns the result of `call`; empty: the result has not come within `patience`, or too many
  /// calls wait. `call` must own what it uses, because it runs to its end even if Wait has
  /// returned.
  template <typename Call>
  auto Wait(Call call) -> std::optional<decltype(call())> {
    auto promise = std::make_shared<std::promise<decltype(call())>>();
    auto result = promise->get_future();
    const bool begun =
        Begin([promise, call = std::move(call)]() mutable { promise->set_value(call()); });
    if (!begun || result.wait_for(patience_) != std::future_status::ready) return std::nullopt;
    return result.get();
  }
  /// Runs `call` without waiting for it. False: the call was dropped, because another call waits or
  /// runs.
  bool Offer(std::function<void()> call);

  /// Returns when all calls have ended; later calls are dropped. Stop can be called again.
  void Stop() { worker_.Stop(); }

 private:
  using Call = std::function<void()>;
  static constexpr std::size_t kMostWaiting = 16;

  bool Begin(Call call);

  const Duration patience_;
  std::atomic<int> pending_ = 0;
  WorkQueue<Call> calls_{kMostWaiting};
  Worker worker_;
};

}  // namespace baudgate::records
