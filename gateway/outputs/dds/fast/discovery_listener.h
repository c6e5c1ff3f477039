// The listener of the gateway's participant: hears of the readers and writers of others.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <string>
#include <utility>

#include "gateway/outputs/dds/fast/unmet_readers.h"
#include "gateway/outputs/dds/fast/volatile_writers.h"

namespace baudgate::dds {

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
