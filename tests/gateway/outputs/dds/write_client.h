// `WriteClient`: a client on Fast DDS that sends requests to a gateway and receives its replies.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/fast/participant.h"
#include "gateway/outputs/dds/fast/types.h"
#include "tests/gateway/outputs/dds/fixture.h"

namespace baudgate::dds::testing {

inline bool Eventually(const std::function<bool()>& condition) {
  const Instant end = std::chrono::steady_clock::now() + 20s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(5ms);
  }
  return true;
}

inline RequestSample Request(std::uint64_t seq, const std::string& gateway = "substation-7",
                             const std::string& client = "plc-1") {
  RequestSample request;
  request.gateway = gateway, request.client = client, request.seq = seq;
  request.device = "feeder-1", request.point = "setting_group", request.value = 1;
  return request;
}

class WriteClient {
 public:
  explicit WriteClient(bool transient_local = false, const config::DdsSecurity& security = {}) {
    ParticipantOptions options = TestSubscriber().participant;
    options.security = security;
    auto made = CreateParticipant(options);
    EXPECT_TRUE(made.ok());
    participant_ = *made;
    eprosima::fastdds::dds::DataWriterQos writing;
    writing.reliability().kind = eprosima::fastdds::dds::RELIABLE_RELIABILITY_QOS;
    writing.durability().kind = transient_local
                                    ? eprosima::fastdds::dds::TRANSIENT_LOCAL_DURABILITY_QOS
                                    : eprosima::fastdds::dds::VOLATILE_DURABILITY_QOS;
    writing.resource_limits() = Room(writing.resource_limits());
    writer_ = participant_->create_publisher(eprosima::fastdds::dds::PUBLISHER_QOS_DEFAULT)
                  ->create_datawriter(TopicOf(NewRequestType(), kRequestTopic), writing);
    eprosima::fastdds::dds::DataReaderQos reading;
    reading.reliability().kind = eprosima::fastdds::dds::RELIABLE_RELIABILITY_QOS;
    reading.durability().kind = eprosima::fastdds::dds::TRANSIENT_LOCAL_DURABILITY_QOS;
    reading.resource_limits() = Room(reading.resource_limits());
    reader_ = participant_->create_subscriber(eprosima::fastdds::dds::SUBSCRIBER_QOS_DEFAULT)
                  ->create_datareader(TopicOf(NewReplyType(), kReplyTopic), reading);
  }
  ~WriteClient() { DeleteParticipant(participant_); }
  WriteClient(const WriteClient&) = delete;
  WriteClient& operator=(const WriteClient&) = delete;

  bool made() const { return writer_ != nullptr && reader_ != nullptr; }

  bool matched() const {
    if (!made()) return false;
    eprosima::fastdds::dds::PublicationMatchedStatus asked;
    eprosima::fastdds::dds::SubscriptionMatchedStatus heard;
    writer_->get_publication_matched_status(asked);
    reader_->get_subscription_matched_status(heard);
    return asked.current_count > 0 && heard.current_count > 0;
  }
  bool Ask(RequestSample request) { return writer_->write(&request); }
  std::optional<ReplySample> Take() {
    ReplySample reply;
    eprosima::fastdds::dds::SampleInfo info;
    while (reader_->take_next_sample(&reply, &info) ==
           eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) return reply;
    }
    return std::nullopt;
  }
  WriterId id() const {
    const auto& guid = writer_->guid();
    WriterId id;
    std::copy_n(guid.guidPrefix.value, 12, id.publisher.bytes.begin());
    std::copy_n(guid.entityId.value, 4, id.entity.begin());
    return id;
  }

 private:
  static eprosima::fastdds::dds::ResourceLimitsQosPolicy Room(
      eprosima::fastdds::dds::ResourceLimitsQosPolicy room) {
    room.max_instances = 10000;
    room.max_samples = 10000;
    room.max_samples_per_instance = 1;
    return room;
  }
  eprosima::fastdds::dds::Topic* TopicOf(eprosima::fastdds::dds::TopicDataType* type,
                                         const char* name) {
    const eprosima::fastdds::dds::TypeSupport support(type);
    support.register_type(participant_);
    return participant_->create_topic(name, support.get_type_name(),
                                      eprosima::fastdds::dds::TOPIC_QOS_DEFAULT);
  }

  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
};

}  // namespace baudgate::dds::testing
