// Descriptors wait in one queue for at most kMostClosers threads, which end when it is empty.
// SPDX-License-Identifier: Apache-2.0
#include "transports/closer.h"

#include <unistd.h>

#include <deque>
#include <memory>

#include "gateway/base/worker.h"

namespace baudgate {
namespace {

struct Queue {
  Mutex mutex;
  std::deque<int> waiting BAUDGATE_GUARDED_BY(mutex);
  int threads BAUDGATE_GUARDED_BY(mutex) = 0;
};

void Work(const std::shared_ptr<Queue>& queue) {
  for (;;) {
    int fd = -1;
    {
      const MutexLock lock(queue->mutex);
      if (queue->waiting.empty()) {
        --queue->threads;
        return;
      }
      fd = queue->waiting.front();
      queue->waiting.pop_front();
    }
    close(fd);
  }
}

}  // namespace

void CloseElsewhere(int fd) {
  // Shared by all lines of the process, and owned by the threads as well: they may outlive main().
  static const std::shared_ptr<Queue> queue = std::make_shared<Queue>();
  const MutexLock lock(queue->mutex);
  queue->waiting.push_back(fd);
  if (queue->threads >= kMostClosers) return;
  if (StartDetached("close port", [shared = queue] { Work(shared); })) {
    ++queue->threads;
  } else if (queue->threads == 0) {  // otherwise a thread that runs closes it
    queue->waiting.pop_back();
    close(fd);
  }
}

}  // namespace baudgate
