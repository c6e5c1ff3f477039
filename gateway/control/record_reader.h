// Answers requests that read the disk, on a thread of their own: a disk that hangs holds up nobody
// who asks for something else.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "gateway/base/guarded.h"
#include "gateway/base/worker.h"
#include "gateway/control/commands.h"

namespace baudgate::control {

class RecordReader {
 public:
  /// So many requests wait at most.
  static constexpr std::size_t kMost = 16;

  explicit RecordReader(Gateway gateway);

  /// `later` takes the answer, on the thread of this. Not ok: too many wait already.
  Reply Ask(const Command& command, Json request, Writer client, Now now,
            std::function<void(std::string text)> later);
  /// A reload. Waits for the answer that is being read.
  void Apply(const config::Config& config, const history::HistorySource* history);
  /// Likewise; what waits is not answered.
  void Stop() { worker_.Stop(); }

 private:
  struct Job {
    const Command* command;
    Json request;
    Writer client;
    Now now;
    std::function<void(std::string text)> later;
  };
  Instant Round(bool last);

  Mutex mutex_;
  Gateway gateway_ BAUDGATE_GUARDED_BY(mutex_);
  WorkQueue<Job> queue_{kMost};
  Worker worker_;
};

}  // namespace baudgate::control
