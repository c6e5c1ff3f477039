// `DiscoveryListener` is informed by Fast DDS about the readers and writers of other participants.
// VolatileWriters stores which writers are volatile; UnmetReaders stores which readers request a
// QoS that the gateway does not offer.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <map>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/outputs/dds/fast/inbox.h"

namespace baudgate::dds {

// VolatileWriters stores which writers of one topic are volatile, i.e. store no samples for later
// readers. Only write requests of volatile writers are carried out, because a writer that stores
// samples can send old requests to our new reader. Example: Fast DDS 2.9 asks for all numbers in a
// heartbeat, and Cyclone DDS 0.10 then sends them, although our reader is volatile.
class VolatileWriters {
 public:
  explicit VolatileWriters(std::string topic) : topic_(std::move(topic)) {}

  /// True if the writer is known and volatile. Any thread may call it.
  bool Has(const Handle& writer) const;
  /// To be called when a writer was found, has changed or has left. Any thread may call it.
  void OnWriter(const eprosima::fastrtps::rtps::WriterDiscoveryInfo& info);

 private:
  static constexpr std::size_t kMost = 8192;

  const std::string topic_;
  mutable Mutex mutex_;
  std::unordered_set<Handle, HandleHash> writers_ BAUDGATE_GUARDED_BY(mutex_);
};

// UnmetReaders stores the readers whose QoS requests more than the gateway's writers offer: these
// readers receive no samples, without any error message. docs/dds.md, "What a reader may ask for",
// lists the policies.
class UnmetReaders {
 public:
  /// To be called when a reader was found, has changed or has left. Any thread may call it.
  void OnReader(const eprosima::fastrtps::rtps::ReaderDiscoveryInfo& info);
  /// Returns one sentence per unmet reader. Readers of one topic and address that ask for the same
  /// QoS share a sentence.
  std::vector<std::string> Sentences() const;

 private:
  static constexpr std::size_t kMost = 256;

  mutable Mutex mutex_;
  std::map<Handle, std::string> readers_ BAUDGATE_GUARDED_BY(mutex_);
};

/// The listener must outlive its participant.
class DiscoveryListener final : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  explicit DiscoveryListener(std::string asked_on) : askers(std::move(asked_on)) {}

  VolatileWriters askers;
  UnmetReaders unmet;

 private:
  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override {
    askers.OnWriter(info);
  }
  void on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant*,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& info) override {
    unmet.OnReader(info);
  }
};

}  // namespace baudgate::dds
