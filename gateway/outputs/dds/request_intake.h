// Write requests on their way to the part that carries them out. Their rate and the number that
// waits are bounded; requests beyond are counted and dropped, and their client asks again. From the
// DDS library's threads to gateway/outputs/dds/link/link_server.h, and from there to
// gateway/outputs/dds/writes/dds_writes.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/pacer.h"
#include "gateway/outputs/dds/samples.h"
#include "gateway/outputs/dds/writer_id.h"

namespace baudgate::dds {

struct WriteArrival {
  RequestSample request;
  WriterId writer;
  Instant received{};  ///< by the process that speaks DDS
  /// By the clock of its client, as its time stamp says; 1970: it carries none.
  WallTime published{};
  /// It was published before there was a reader of requests to this gateway.
  bool early = false;
  /// Its writer is not known to keep nothing: it may be older than this reader.
  bool lasting = false;
};

class RequestIntake {
 public:
  static constexpr std::size_t kMost = 128;     ///< that wait
  static constexpr Duration kInterval = 2ms;    ///< one each, after a burst
  static constexpr std::uint32_t kBurst = 128;  ///< requests at once

  /// `wake`: on the thread of Offer, after something has come.
  explicit RequestIntake(std::function<void()> wake) : wake_(std::move(wake)) {}

  /// From any thread.
  void Offer(WriteArrival arrival, Instant now);
  std::optional<WriteArrival> Take();
  /// That found no room, so far.
  std::uint64_t dropped() const;

 private:
  bool Keep(WriteArrival& arrival, Instant now);

  const std::function<void()> wake_;
  mutable Mutex mutex_;
  Pacer pace_ BAUDGATE_GUARDED_BY(mutex_){kInterval, kBurst};
  std::deque<WriteArrival> waiting_ BAUDGATE_GUARDED_BY(mutex_);
  std::uint64_t dropped_ BAUDGATE_GUARDED_BY(mutex_) = 0;
};

}  // namespace baudgate::dds
