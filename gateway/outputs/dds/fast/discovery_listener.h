// The listener of the gateway's participant: hears of the readers and writers of others.
// VolatileWriters keeps which writers keep nothing for later readers, and UnmetReaders which
// readers ask for more than is offered.
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

// Which writers keep nothing for readers to come. Only their requests are carried out: a writer
// that keeps what it wrote must not send it to a volatile reader that is new, but Cyclone DDS 0.10
// does, because Fast DDS 2.9 asks for all that a heartbeat names.
class VolatileWriters {
 public:
  /// Those of this topic.
  explicit VolatileWriters(std::string topic) : topic_(std::move(topic)) {}

  /// False, too, where nothing is known of it. From any thread.
  bool Has(const Handle& writer) const;
  /// A writer was found, has changed or has left. From any thread.
  void OnWriter(const eprosima::fastrtps::rtps::WriterDiscoveryInfo& info);

 private:
  static constexpr std::size_t kMost = 8192;

  const std::string topic_;
  mutable Mutex mutex_;
  std::unordered_set<Handle, HandleHash> writers_ BAUDGATE_GUARDED_BY(mutex_);
};

// Readers of the gateway's topics whose QoS asks for more than its writers offer. DDS gives them
// nothing and reports nothing. docs/dds.md, "What a reader may ask for", has the table.
class UnmetReaders {
 public:
  /// A reader was found, has changed or has left. From any thread.
  void OnReader(const eprosima::fastrtps::rtps::ReaderDiscoveryInfo& info);
  /// A sentence for each; readers of one address that ask for the same share one.
  std::vector<std::string> Sentences() const;

 private:
  static constexpr std::size_t kMost = 256;

  mutable Mutex mutex_;
  std::map<Handle, std::string> readers_ BAUDGATE_GUARDED_BY(mutex_);
};

/// Outlives its participant.
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
