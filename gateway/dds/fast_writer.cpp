// The SampleWriter on Fast DDS: samples come from the publisher and go to all subscribers.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "gateway/dds/sample_writer.h"
#include "gateway/dds/types.h"

namespace baudgate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::Duration_t;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr std::size_t kSpareInstances = 16;

// With each heartbeat Fast DDS 2.9 walks through all sequence numbers from the oldest sample kept to
// the newest, under the writer's lock: the more points, the rarer it may be.
constexpr std::size_t kPointsPerHeartbeatStep = 10'000;

Duration HeartbeatPeriod(std::size_t instances) {
  return 100ms * static_cast<std::int64_t>(1 + instances / kPointsPerHeartbeatStep);
}

Duration_t Seconds(Duration duration) {
  return Duration_t(static_cast<std::int32_t>(duration / 1s),
                    static_cast<std::uint32_t>((duration % 1s).count()));
}

// All limits together: Fast DDS takes 10 instances by default, and fewer samples than instances
// times samples per instance make no writer at all.
fast::DataWriterQos WriterQos(std::size_t instances) {
  fast::DataWriterQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 1;
  const auto limit = static_cast<std::int32_t>(instances + kSpareInstances);
  qos.resource_limits().max_instances = limit;
  qos.resource_limits().max_samples = limit;
  qos.resource_limits().max_samples_per_instance = 1;
  qos.reliable_writer_qos().times.heartbeatPeriod =
      Seconds(HeartbeatPeriod(instances));
  return qos;
}

class MatchCounter : public fast::DataWriterListener {
 public:
  void on_publication_matched(fast::DataWriter*,
                              const fast::PublicationMatchedStatus& status) override {
    current_ = static_cast<std::uint32_t>(std::max(0, status.current_count));
  }
  std::uint32_t current() const { return current_; }

 private:
  std::atomic<std::uint32_t> current_ = 0;
};

class FastWriter : public SampleWriter {
 public:
  explicit FastWriter(fast::DomainParticipant* participant) : participant_(participant) {}
  ~FastWriter() override {
    // One by one, as the library does it by itself, 100,000 samples compete for the writer's lock
    // with its heartbeats for minutes.
    for (fast::DataWriter* writer : {points_, devices_}) {
      std::size_t removed = 0;
      if (writer != nullptr) writer->clear_history(&removed);
    }
    DeleteParticipant(participant_);
  }

  bool Open(std::size_t points, std::size_t devices) {
    publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    if (publisher_ == nullptr) return false;
    points_ = OpenWriter(NewPointType(), kPointTopic, points, &matches_);
    devices_ = OpenWriter(NewDeviceType(), kDeviceTopic, devices, nullptr);
    return points_ != nullptr && devices_ != nullptr;
  }

  bool Write(const PointSample& sample) override { return WriteTo(points_, sample); }
  bool Write(const DeviceSample& sample) override { return WriteTo(devices_, sample); }
  bool Dispose(const PointSample& sample) override { return DisposeIn(points_, sample); }
  bool Dispose(const DeviceSample& sample) override { return DisposeIn(devices_, sample); }

  bool WaitAcknowledged(Duration most) override {
    const Instant deadline = std::chrono::steady_clock::now() + most;
    for (fast::DataWriter* writer : {points_, devices_}) {
      const Duration left = std::max(Duration(0), deadline - std::chrono::steady_clock::now());
      if (writer->wait_for_acknowledgments(Seconds(left)) != ReturnCode_t::RETCODE_OK) return false;
    }
    return true;
  }

  std::uint32_t subscribers() const override { return matches_.current(); }

 private:
  fast::DataWriter* OpenWriter(fast::TopicDataType* type, const char* topic_name,
                               std::size_t instances, fast::DataWriterListener* listener) {
    const fast::TypeSupport support(type);
    if (support.register_type(participant_) != ReturnCode_t::RETCODE_OK) return nullptr;
    auto* topic = participant_->create_topic(topic_name, support.get_type_name(),
                                             fast::TOPIC_QOS_DEFAULT);
    if (topic == nullptr) return nullptr;
    return publisher_->create_datawriter(topic, WriterQos(instances), listener);
  }

  // The library takes no const samples; it only reads them.
  template <typename Sample>
  static bool WriteTo(fast::DataWriter* writer, const Sample& sample) {
    try {
      return writer->write(const_cast<Sample*>(&sample), fast::HANDLE_NIL) ==
             ReturnCode_t::RETCODE_OK;
    } catch (const std::exception&) {
      return false;
    }
  }

  template <typename Sample>
  static bool DisposeIn(fast::DataWriter* writer, const Sample& sample) {
    try {
      return writer->dispose(const_cast<Sample*>(&sample), fast::HANDLE_NIL) ==
             ReturnCode_t::RETCODE_OK;
    } catch (const std::exception&) {
      return false;
    }
  }

  MatchCounter matches_;
  fast::DomainParticipant* participant_;
  fast::Publisher* publisher_ = nullptr;
  fast::DataWriter* points_ = nullptr;
  fast::DataWriter* devices_ = nullptr;
};

}  // namespace

Result<std::unique_ptr<SampleWriter>> CreateFastWriter(const ParticipantOptions& options,
                                                       std::size_t points, std::size_t devices) {
  auto participant = CreateParticipant(options);
  if (!participant) return Error{participant.error()};
  auto writer = std::make_unique<FastWriter>(*participant);
  if (!writer->Open(points, devices)) {
    return Error{"dds: no writer for " + std::to_string(points) + " points could be made"};
  }
  return std::unique_ptr<SampleWriter>(std::move(writer));
}

}  // namespace baudgate::dds
