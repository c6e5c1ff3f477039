// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/write_topics.h"

#include <fastdds/dds/core/status/StatusMask.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "gateway/outputs/dds/fast/types.h"

namespace baudgate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;

// The most DDS instances of requests, to all gateways; each client name is an instance. The library
// stores an instance while a writer of it exists.
constexpr int kNamesOfRequests = 4096;
// The most client names in replies of this gateway. The library stores a name until the writer of
// replies is deleted.
constexpr int kNamesOfReplies = 1024;
// The most samples that are stored for each client name. Requests are taken as soon as they arrive,
// so several are stored only if one datagram contains several.
constexpr int kSamplesEach = 4;

/// Returns a QoS with all limits set, because the defaults of Fast DDS are too low (WriterQos in
/// gateway/outputs/dds/fast/fast_writer.cpp).
template <typename Qos>
Qos Bounded(fast::DurabilityQosPolicyKind durability, int names) {
  Qos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = durability;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = kSamplesEach;
  qos.resource_limits().max_instances = names;
  qos.resource_limits().max_samples_per_instance = kSamplesEach;
  qos.resource_limits().max_samples = names * kSamplesEach;
  return qos;
}

fast::Topic* MakeTopic(fast::DomainParticipant& participant, fast::TopicDataType* type,
                       const char* name) {
  const fast::TypeSupport support(type);
  if (support.register_type(&participant) != ReturnCode_t::RETCODE_OK) return nullptr;
  return participant.create_topic(name, support.get_type_name(), fast::TOPIC_QOS_DEFAULT);
}

}  // namespace

bool WriteTopics::Open(fast::DomainParticipant& participant) {
  publisher_ = participant.create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant.create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  replies_ = MakeTopic(participant, NewReplyType(), kReplyTopic);
  requests_ = MakeTopic(participant, NewRequestType(), kRequestTopic);
  return publisher_ != nullptr && subscriber_ != nullptr && replies_ != nullptr &&
         requests_ != nullptr && OpenWriter() && OpenReader();
}

/// Creates the writer of replies. It is transient local, because a client's reader of replies can
/// be discovered later than its writer of requests.
bool WriteTopics::OpenWriter() {
  auto qos = Bounded<fast::DataWriterQos>(fast::TRANSIENT_LOCAL_DURABILITY_QOS, kNamesOfReplies);
  qos.reliable_writer_qos().times.heartbeatPeriod = DdsTime(100ms);
  writer_ = publisher_->create_datawriter(replies_, qos);
  return writer_ != nullptr;
}

bool WriteTopics::OpenReader() {
  const auto qos = Bounded<fast::DataReaderQos>(fast::VOLATILE_DURABILITY_QOS, kNamesOfRequests);
  opened_ = ReadClocks().instant;
  reader_ = subscriber_->create_datareader(requests_, qos, this);
  return reader_ != nullptr;
}

void WriteTopics::Renew() {
  if (!full_) return;
  if (reader_ != nullptr) subscriber_->delete_datareader(reader_);
  full_ = !OpenReader();
}

void WriteTopics::OnRequest(SampleWriter::TakeRequest take) {
  const MutexLock lock(mutex_);
  take_ = std::move(take);
}

/// Writes a reply. If the writer accepts no reply, e.g. because it has no space for a new client
/// name, it is replaced by a new writer without stored replies.
Sent WriteTopics::Write(const ReplySample& reply) {
  if (writer_ != nullptr && TryWrite(reply)) return Sent::yes;
  if (writer_ != nullptr) publisher_->delete_datawriter(writer_);
  return OpenWriter() && TryWrite(reply) ? Sent::yes : Sent::refused;
}

// write() requires a non-const pointer, but only reads the sample.
bool WriteTopics::TryWrite(const ReplySample& reply) {
  try {
    const auto code = writer_->write(const_cast<ReplySample*>(&reply), fast::HANDLE_NIL);
    return code == ReturnCode_t::RETCODE_OK;
  } catch (const std::exception&) {
    return false;
  }
}

void WriteTopics::on_data_available(fast::DataReader* reader) {
  WriteArrival arrival;
  fast::SampleInfo info{};
  while (reader->take_next_sample(&arrival.request, &info) == ReturnCode_t::RETCODE_OK) {
    if (!info.valid_data || arrival.request.gateway != gateway_) continue;
    if (full_) {
      ++dropped_;
      continue;
    }
    const Handle writer = HandleOf(info.publication_handle);
    arrival.writer = WriterOf(writer);
    arrival.lasting = !writers_.Has(writer);
    const Now now = ReadClocks();
    arrival.received = now.instant;
    arrival.published = WallTime(Duration(info.source_timestamp.to_ns()));
    // The age of the reader is measured with the steady clock, so that setting the wall clock does
    // not change it.
    arrival.early = arrival.published < now.wall - (now.instant - opened_.load());
    const MutexLock lock(mutex_);
    if (take_) take_(arrival);
  }
}

void WriteTopics::on_sample_rejected(fast::DataReader*, const fast::SampleRejectedStatus& status) {
  full_ = true;
  dropped_ += static_cast<std::uint64_t>(status.total_count_change);
}

}  // namespace baudgate::dds
