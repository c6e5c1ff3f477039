// What is wrong with the disk of a log, and since when. No lock, no clock: the logs have them.
//
//   Set(fine)                       nothing new
//   Set(stalled, "does not answer") begun
//   Set(failing, "it is full")      nothing new: the trouble goes on
//   Set(fine)                       ended: "it is full"
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/records/disk/disk.h"

namespace baudgate {

class DiskCondition {
 public:
  explicit DiskCondition(WallTime since) : since_(since) {}

  /// A trouble that has ended.
  struct Past {
    std::string trouble;
    WallTime since{};
  };
  /// What the log is told.
  struct News {
    bool begun = false;
    std::optional<Past> ended{};
  };
  /// `trouble`: empty: none.
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
  /// It keeps what waits from being written.
  bool holds_up() const { return is_stalled() || is_failing(); }
  const std::string& trouble() const { return trouble_; }

  /// Damaged files that are still there, by name.
  void SetPutAside(std::vector<std::string> files) { put_aside_ = std::move(files); }
  const std::vector<std::string>& put_aside() const { return put_aside_; }

  /// `State`: what others are told of a log.
  template <typename State>
  void Fill(State& state) const {
    state.disk = disk_;
    state.trouble = trouble_;
    state.since = since_;
  }

 private:
  Disk disk_ = Disk::opening;
  std::string trouble_;
  WallTime since_;  // of `disk_`
  std::vector<std::string> put_aside_;
};

}  // namespace baudgate
