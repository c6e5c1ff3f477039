// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/fast_writer.h"

#include <algorithm>
#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "gateway/outputs/dds/fast/discovery_listener.h"
#include "gateway/outputs/dds/fast/own_network.h"
#include "gateway/outputs/dds/fast/participant.h"
#include "gateway/outputs/dds/fast/types.h"
#include "gateway/outputs/dds/fast/write_topics.h"
#include "gateway/outputs/dds/point_samples.h"

namespace baudgate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr std::size_t kSpareInstances = 16;

// The most instances of one writer. Fast DDS 2.9 searches a writer's whole history for the sample
// that a new sample replaces, and walks through the history with every heartbeat, under its lock:
// one writer of 100,000 points needs 350 us for a sample, and minutes for its deletion. Several
// writers of this size together are as fast as one.
constexpr std::size_t kInstancesPerWriter = 4096;

// Events that are stored for late subscribers, of all devices together: about 60 MB.
constexpr std::size_t kMostEvents = 100'000;
// The most alarms that are stored; gateway/records/events stores at most as many.
constexpr std::size_t kMostAlarms = 10'000;

std::size_t EventDepth(std::size_t devices) {
  return std::clamp<std::size_t>(kMostEvents / std::max<std::size_t>(1, devices), 1, kEventDepth);
}

std::size_t WritersFor(std::size_t instances) {
  return std::max<std::size_t>(1, (instances + kInstancesPerWriter - 1) / kInstancesPerWriter);
}

/// Returns the instances that one writer must be able to store. It is more than an equal share,
/// because a hash distributes the names unevenly.
std::size_t InstancesEach(std::size_t instances) {
  const std::size_t writers = WritersFor(instances);
  const std::size_t part = (instances + writers - 1) / writers;
  return kSpareInstances + (writers == 1 ? part : part + part / 4);
}

std::size_t Scatter(const PointSample& sample) {
  const std::hash<std::string_view> hash;
  return hash(sample.device) * 31 + hash(sample.point);
}
std::size_t Scatter(const DeviceSample& sample) {
  return std::hash<std::string_view>()(sample.device);
}
std::size_t Scatter(const GatewaySample&) { return 0; }
std::size_t Scatter(const EventSample& sample) {
  return std::hash<std::string_view>()(sample.device);
}

std::size_t Scatter(const AlarmSample& sample) {
  const std::hash<std::string_view> hash;
  return hash(sample.device) * 31 + hash(sample.name);
}

// Sets all resource limits, because Fast DDS accepts only 10 instances by default, and creates no
// writer if max_samples is less than instances times samples per instance.
fast::DataWriterQos WriterQos(std::size_t room, std::size_t depth) {
  fast::DataWriterQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = static_cast<std::int32_t>(depth);
  qos.resource_limits().max_instances = static_cast<std::int32_t>(room);
  qos.resource_limits().max_samples = static_cast<std::int32_t>(room * depth);
  qos.resource_limits().max_samples_per_instance = static_cast<std::int32_t>(depth);
  qos.reliable_writer_qos().times.heartbeatPeriod = DdsTime(100ms);
  return qos;
}

Sent Said(const ReturnCode_t& code) {
  return code == ReturnCode_t::RETCODE_OK ? Sent::yes : Sent::refused;
}

class MatchCounter : public fast::DataWriterListener {
 public:
  void on_publication_matched(fast::DataWriter*,
                              const fast::PublicationMatchedStatus& status) override {
    current_ = static_cast<std::uint32_t>(std::max(0, status.current_count));
  }
  std::uint32_t current() const { return current_; }
  /// To be called when the writer is deleted, because the library does not report its readers as
  /// unmatched then.
  void Clear() { current_ = 0; }

 private:
  std::atomic<std::uint32_t> current_ = 0;
};

/// The writers of one topic. An instance always uses the same writer.
class TopicWriters {
 public:
  bool Open(fast::DomainParticipant& participant, fast::Publisher& publisher,
            fast::TopicDataType* type, const char* name, std::size_t instances,
            std::size_t depth = 1) {
    const fast::TypeSupport support(type);
    if (support.register_type(&participant) != ReturnCode_t::RETCODE_OK) return false;
    topic_ = participant.create_topic(name, support.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    return topic_ != nullptr && Fill(publisher, instances, depth);
  }

  bool Reopen(fast::Publisher& publisher, std::size_t instances, std::size_t depth = 1) {
    if (topic_ == nullptr) return true;
    Clear();
    for (fast::DataWriter* writer : writers_) publisher.delete_datawriter(writer);
    writers_.clear();
    readers_.Clear();
    return Fill(publisher, instances, depth);
  }

  std::uint32_t readers() const { return readers_.current(); }

  // write() requires a non-const pointer, but only reads the sample.
  template <typename Sample>
  Sent Write(const Sample& sample) {
    if (writers_.empty()) return Sent::refused;
    try {
      return Said(Of(sample).write(const_cast<Sample*>(&sample), fast::HANDLE_NIL));
    } catch (const std::exception&) {
      return Sent::refused;
    }
  }

  bool WaitAcknowledged(Instant deadline) {
    for (fast::DataWriter* writer : writers_) {
      const Duration left = std::max(Duration(0), deadline - std::chrono::steady_clock::now());
      if (writer->wait_for_acknowledgments(DdsTime(left)) != ReturnCode_t::RETCODE_OK) return false;
    }
    return true;
  }

  /// Clears the writers' histories, so that their deletion is fast: otherwise the library returns
  /// each sample separately under a contended lock.
  void Clear() {
    for (fast::DataWriter* writer : writers_) {
      std::size_t removed = 0;
      writer->clear_history(&removed);
    }
  }

 private:
  bool Fill(fast::Publisher& publisher, std::size_t instances, std::size_t depth) {
    while (writers_.size() < WritersFor(instances)) {
      auto* writer = publisher.create_datawriter(topic_, WriterQos(InstancesEach(instances), depth),
                                                 writers_.empty() ? &readers_ : nullptr);
      if (writer == nullptr) return false;
      writers_.push_back(writer);
    }
    return true;
  }

  template <typename Sample>
  fast::DataWriter& Of(const Sample& sample) {
    if (writers_.size() == 1) return *writers_.front();
    return *writers_[Scatter(sample) % writers_.size()];
  }

  MatchCounter readers_;
  fast::Topic* topic_ = nullptr;
  std::vector<fast::DataWriter*> writers_;
};

class FastWriter : public SampleWriter {
 public:
  FastWriter(fast::DomainParticipant* participant, const ParticipantOptions& options,
             std::unique_ptr<DiscoveryListener> listener)
      : listener_(std::move(listener)), participant_(participant), options_(options) {}
  ~FastWriter() override {
    points_.Clear();
    devices_.Clear();
    gateways_.Clear();
    events_.Clear();
    alarms_.Clear();
    DeleteParticipant(participant_);
  }

  bool Open(const Room& room) {
    publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    const auto open = [this](TopicWriters& writers, auto... rest) {
      return writers.Open(*participant_, *publisher_, rest...);
    };
    return publisher_ != nullptr && open(points_, NewPointType(), kPointTopic, room.points) &&
           open(devices_, NewDeviceType(), kDeviceTopic, room.devices) &&
           open(gateways_, NewGatewayType(), kGatewayTopic, 1) &&
           (room.events == 0 ||
            (open(events_, NewEventType(), kEventTopic, room.devices, EventDepth(room.events)) &&
             open(alarms_, NewAlarmType(), kAlarmTopic, kMostAlarms)));
  }

  Sent Reopen(const Room& room) override {
    const bool opened = points_.Reopen(*publisher_, room.points) &&
                        devices_.Reopen(*publisher_, room.devices) &&
                        events_.Reopen(*publisher_, room.devices, EventDepth(room.events)) &&
                        alarms_.Reopen(*publisher_, kMostAlarms);
    if (opened) ++session_;
    return opened ? Sent::yes : Sent::refused;
  }
  std::uint64_t session() const override { return session_; }

  Sent Write(const PointSample& sample) override {
    if (requests_) requests_->Renew();
    return points_.Write(sample);
  }
  Sent Write(const DeviceSample& sample) override { return devices_.Write(sample); }
  Sent Write(const GatewaySample& sample) override { return gateways_.Write(sample); }

  Sent Write(const EventSample& sample) override { return events_.Write(sample); }
  Sent Write(const AlarmSample& sample) override { return alarms_.Write(sample); }

  Sent Write(const ReplySample& reply) override {
    return requests_ ? requests_->Write(reply) : Sent::refused;
  }
  void OnRequest(TakeRequest take) override {
    if (requests_) requests_->OnRequest(std::move(take));
  }
  std::uint64_t dropped_requests() const override { return requests_ ? requests_->dropped() : 0; }

  bool Listen(const std::string& gateway) {
    requests_.emplace(gateway, listener_->askers);
    return requests_->Open(*participant_);
  }

  bool WaitAcknowledged(Duration most) override {
    const Instant deadline = std::chrono::steady_clock::now() + most;
    return points_.WaitAcknowledged(deadline) && devices_.WaitAcknowledged(deadline) &&
           gateways_.WaitAcknowledged(deadline) && events_.WaitAcknowledged(deadline) &&
           alarms_.WaitAcknowledged(deadline);
  }

  Subscribers subscribers() const override {
    return {points_.readers(), devices_.readers(), events_.readers(), alarms_.readers()};
  }
  DatagramCounters datagrams() const override { return DatagramsOf(*participant_); }
  Neighbours neighbours() const override {
    Neighbours neighbours = NeighboursOf(*participant_, options_);
    const auto unmet = listener_->unmet.Sentences();
    auto& remarks = neighbours.remarks;
    remarks.insert(remarks.begin(), unmet.begin(), unmet.end());
    const auto deaf = RemarksOn(FindSocketFacts(options_, FindOwnAddresses()), options_);
    remarks.insert(remarks.begin(), deaf.begin(), deaf.end());
    if (remarks.size() > Neighbours::kMostRemarks) {
      const std::size_t more = remarks.size() - Neighbours::kMostRemarks + 1;
      remarks.resize(Neighbours::kMostRemarks);
      remarks.back() = std::to_string(more) + " more warnings are not shown";
    }
    return neighbours;
  }

 private:
  // The listener is destroyed after participant_, which uses it.
  const std::unique_ptr<DiscoveryListener> listener_;
  fast::DomainParticipant* participant_;
  fast::Publisher* publisher_ = nullptr;
  std::atomic<std::uint64_t> session_ = 1;
  const ParticipantOptions options_;
  TopicWriters points_;
  TopicWriters devices_;
  TopicWriters gateways_;
  TopicWriters events_;  ///< not opened if the gateway has no events
  TopicWriters alarms_;
  std::optional<WriteTopics> requests_;
};

}  // namespace

Result<std::unique_ptr<SampleWriter>> CreateFastWriter(const ParticipantOptions& options,
                                                       const Room& room,
                                                       const std::string& requests_for) {
  auto listener = std::make_unique<DiscoveryListener>(kRequestTopic);
  auto participant = CreateParticipant(options, listener.get(), Role::publishes);
  if (!participant) return Error{participant.error()};
  auto writer = std::make_unique<FastWriter>(*participant, options, std::move(listener));
  if (!writer->Open(room)) {
    return Error{"dds: cannot create a writer for " + std::to_string(room.points) + " points" +
                 (options.security.on() ? "; check that " + options.security.permissions +
                                              " let this gateway publish baudgate/*"
                                        : "")};
  }
  if (!requests_for.empty() && !writer->Listen(requests_for)) {
    return Error{std::string("dds: cannot subscribe to write requests") +
                 (options.security.on() ? "; check that " + options.security.permissions +
                                              " let this gateway subscribe baudgate/write and "
                                              "publish baudgate/write_reply"
                                        : "")};
  }
  return std::unique_ptr<SampleWriter>(std::move(writer));
}

Result<std::unique_ptr<SampleWriter>> CreateFastWriter(const config::Config& config,
                                                       const bus::PointStore& store) {
  return CreateFastWriter(ParticipantOf(config.dds), RoomFor(store),
                          config.dds.write ? config.name : std::string());
}

}  // namespace baudgate::dds
