// Requests that wait for one server elsewhere, with the way in for other threads.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/bus/writes/route_queue.h"

namespace baudgate::modbus {

/// All but Submit on one thread.
class UpstreamQueue final : public RouteQueue {
 public:
  /// Requests that wait to be sent; more are not let in, but for some short writes.
  static constexpr std::size_t kMostWaiting = 512;

  enum class Entry : std::uint8_t {
    refused,
    first,  ///< Gather is to be called
    more,
  };
  /// From any thread.
  Entry Submit(RoutedRequest request);

  /// Lets requests in, also after Close.
  void Open();
  /// Queues what other threads have submitted. False: it is closed.
  bool Gather();
  /// Queues it once more, and lets nothing in from then on. False: it was closed already.
  bool Close();
  /// After requests were taken, before they are answered: whoever is answered may ask again at
  /// once.
  void Count() { queued_ = size(); }

 private:
  void QueueIncoming() BAUDGATE_REQUIRES(mutex_);

  Mutex mutex_;
  bool open_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::vector<RoutedRequest> incoming_ BAUDGATE_GUARDED_BY(mutex_);
  std::atomic<std::size_t> queued_ = 0;  // without those that come in
};

}  // namespace baudgate::modbus
