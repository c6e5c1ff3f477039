// `DiscoveryListener` gets the readers and writers of other participants from Fast DDS.
// VolatileWriters contains the writers that are volatile, and UnmetReaders the readers that ask for
// more than is offered.
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

// Volatile writers store nothing for later readers. Only their write requests are carried out: a
// writer that stores samples must not send them to a new volatile reader, but Cyclone DDS 0.10
// does, because Fast DDS 2.9 asks for all numbers that a heartbeat contains.
class VolatileWriters {
 public:
  /// Writers of other topics are ignored.
  explicit VolatileWriters(std::string topic) : topic_(std::move(topic)) {}

  /// False also for an unknown writer. Any thread may call it.
  bool Has(const Handle& writer) const;
  /// A writer was found, has changed or has left. Any thread may call it.
  void OnWriter(const eprosima::fastrtps::rtps::WriterDiscoveryInfo& info);

 private:
  static constexpr std::size_t kMost = 8192;

  const std::string topic_;
  mutable Mutex mutex_;
  std::unordered_set<Handle, HandleHash> writers_ BAUDGATE_GUARDED_BY(mutex_);
};

// Readers whose QoS asks for more than the gateway's writers offer: DDS sends them nothing and
// reports nothing. docs/dds.md, "What a reader may ask for", lists the policies.
class UnmetReaders {
 public:
  /// A reader was found, has changed or has left. Any thread may call it.
  void OnReader(const eprosima::fastrtps::rtps::ReaderDiscoveryInfo& info);
  /// One sentence for each reader. Readers at one address that ask for the same share a sentence.
  std::vector<std::string> Sentences() const;

 private:
  static constexpr std::size_t kMost = 256;

  mutable Mutex mutex_;
  std::map<Handle, std::string> readers_ BAUDGATE_GUARDED_BY(mutex_);
};

/// Must outlive its participant.
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
