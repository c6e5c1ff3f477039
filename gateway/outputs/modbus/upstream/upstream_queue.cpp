// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/upstream/upstream_queue.h"

#include <utility>

namespace baudgate::modbus {

UpstreamQueue::Entry UpstreamQueue::Submit(RoutedRequest request) {
  const MutexLock lock(mutex_);
  const std::size_t waiting = incoming_.size() + queued_;
  if (!open_ || waiting >= LimitFor(request, kMostWaiting)) return Entry::refused;
  incoming_.push_back(std::move(request));
  return incoming_.size() == 1 ? Entry::first : Entry::more;
}

void UpstreamQueue::Open() {
  const MutexLock lock(mutex_);
  open_ = true;
}

bool UpstreamQueue::Gather() {
  const MutexLock lock(mutex_);
  if (!open_) return false;
  QueueIncoming();
  return true;
}

bool UpstreamQueue::Close() {
  const MutexLock lock(mutex_);
  if (!open_) return false;
  open_ = false;
  QueueIncoming();
  return true;
}

void UpstreamQueue::QueueIncoming() {
  for (RoutedRequest& request : incoming_) Push(std::move(request));
  incoming_.clear();
  Count();
}

}  // namespace baudgate::modbus
