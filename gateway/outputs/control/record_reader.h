// Answers requests that read the disk, on a thread of their own: a disk that hangs does not hold up
// other requests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "gateway/base/worker.h"
#include "gateway/outputs/control/commands.h"

namespace baudgate::control {

class RecordReader {
 public:
  /// So many requests wait at most.
  static constexpr std::size_t kMost = 16;

  RecordReader();

  /// `later` takes the answer, on the thread of this. Not ok: too many wait already.
  Reply Ask(const Command& command, std::shared_ptr<const Gateway> gateway, Json request,
            Writer client, Now now, std::function<void(std::string text)> later);
  /// Waits for the answer that is being read; what waits is not answered.
  void Stop() { worker_.Stop(); }

 private:
  struct Job {
    const Command* command;
    std::shared_ptr<const Gateway> gateway;
    Json request;
    Writer client;
    Now now;
    std::function<void(std::string text)> later;
  };
  Instant Round(bool last);

  WorkQueue<Job> queue_{kMost};
  Worker worker_;
};

}  // namespace baudgate::control
