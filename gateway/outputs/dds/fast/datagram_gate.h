// Lets datagrams in or not, counts and tells: gateway/outputs/dds/fast/datagram_check.h for the
// several threads on which the DDS library receives. Used by
// gateway/outputs/dds/fast/checked_transport.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>

#include "gateway/base/guarded.h"
#include "gateway/outputs/dds/datagram_counters.h"
#include "gateway/outputs/dds/fast/datagram_check.h"

namespace baudgate::dds {

class DatagramGate {
 public:
  /// A line for people, once in 10 s at most: what was refused, from whom, how often before.
  using Tell = std::function<void(const std::string& line)>;

  DatagramGate(const CheckOptions& options, Tell tell);

  /// The bytes that may be passed on, some of them changed in place; none: it is refused.
  std::span<std::uint8_t> LetIn(std::span<std::uint8_t> datagram, Sender sender, Instant now);

  DatagramCounters counters() const;
  struct Known {
    std::vector<UdpAddress> reached;
    std::vector<UdpAddress> unanswered;
  };
  Known known(Instant now) const;

 private:
  void Fold(Refusal reason, Sender sender, Instant now) BAUDGATE_REQUIRES(mutex_);

  const Tell tell_;
  mutable Mutex mutex_;
  DatagramCheck check_ BAUDGATE_GUARDED_BY(mutex_);
  DatagramCounters counters_ BAUDGATE_GUARDED_BY(mutex_);
  Instant silent_until_ BAUDGATE_GUARDED_BY(mutex_){};
  std::uint64_t folded_ BAUDGATE_GUARDED_BY(mutex_) = 0;
};

}  // namespace baudgate::dds
