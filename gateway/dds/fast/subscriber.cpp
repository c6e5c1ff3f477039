// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/subscriber.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <map>
#include <unordered_map>

#include "gateway/base/guarded.h"
#include "gateway/dds/fast/participant.h"
#include "gateway/dds/fast/types.h"

namespace baudgate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;
using Handle = std::array<std::uint8_t, 16>;

Handle HandleOf(const fast::InstanceHandle_t& from) {
  Handle handle;
  for (std::size_t i = 0; i < handle.size(); ++i) handle[i] = from.value[i];
  return handle;
}

struct HandleHash {
  std::size_t operator()(const Handle& handle) const {
    std::size_t hash = 0;  // the handle is an MD5 already
    std::memcpy(&hash, handle.data(), sizeof hash);
    return hash;
  }
};

fast::DataReaderQos ReaderQos(std::size_t instances) {
  fast::DataReaderQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 1;
  const auto limit = static_cast<std::int32_t>(instances);
  qos.resource_limits().max_instances = limit;
  qos.resource_limits().max_samples = limit;
  qos.resource_limits().max_samples_per_instance = 1;
  return qos;
}

/// Takes the samples of one topic. The end of an instance comes without its key, and Fast DDS 2.9
/// can not look keys up, so they are kept here.
template <typename Sample>
class Inbox : public fast::DataReaderListener {
 public:
  using OnSample = std::function<void(const Sample&)>;
  using OnGone = std::function<void(const Sample&, Gone)>;

  Inbox(Mutex& calling, OnSample on_sample, OnGone on_gone, std::function<void(int)> on_gateways,
        std::function<void(std::uint64_t)> on_rejected)
      : calling_(calling),
        on_sample_(std::move(on_sample)),
        on_gone_(std::move(on_gone)),
        on_gateways_(std::move(on_gateways)),
        on_rejected_(std::move(on_rejected)) {}

  void on_data_available(fast::DataReader* reader) override {
    const MutexLock lock(calling_);
    // One at a time: a take of many reports samples that could not be decoded as if they were
    // valid.
    fast::SampleInfo info;
    while (reader->take_next_sample(&sample_, &info) == ReturnCode_t::RETCODE_OK) {
      Take(sample_, info);
    }
  }

  void on_subscription_matched(fast::DataReader*,
                               const fast::SubscriptionMatchedStatus& status) override {
    const MutexLock lock(calling_);
    const Handle writer = HandleOf(status.last_publication_handle);
    // The first 12 bytes of a writer's handle name its participant; a large gateway has many
    // writers.
    Handle gateway = writer;
    std::fill(gateway.begin() + 12, gateway.end(), std::uint8_t{0});
    if (status.current_count_change < 0) {
      WriterLeft(writer);
      if (--gateways_[gateway] <= 0) gateways_.erase(gateway);
    } else {
      ++gateways_[gateway];
    }
    if (on_gateways_) on_gateways_(static_cast<int>(gateways_.size()));
  }

  void on_sample_rejected(fast::DataReader*, const fast::SampleRejectedStatus& status) override {
    const MutexLock lock(calling_);
    if (on_rejected_) on_rejected_(status.total_count);
  }

 private:
  struct Known {
    Sample sample;
    Handle writer;
  };

  void Take(const Sample& sample, const fast::SampleInfo& info) BAUDGATE_REQUIRES(calling_) {
    if (info.valid_data) {
      Arrived(sample, info);
    } else if (info.instance_state != fast::ALIVE_INSTANCE_STATE) {
      const bool disposed = info.instance_state == fast::NOT_ALIVE_DISPOSED_INSTANCE_STATE;
      Left(HandleOf(info.instance_handle), disposed ? Gone::disposed : Gone::no_writers);
    }
  }

  void Arrived(const Sample& sample, const fast::SampleInfo& info) BAUDGATE_REQUIRES(calling_) {
    Known& known = known_[HandleOf(info.instance_handle)];
    known.sample = sample;
    known.writer = HandleOf(info.publication_handle);
    if (on_sample_) on_sample_(known.sample);
  }

  void Left(const Handle& instance, Gone why) BAUDGATE_REQUIRES(calling_) {
    const auto at = known_.find(instance);
    if (at == known_.end()) return;
    if (on_gone_) on_gone_(at->second.sample, why);
    known_.erase(at);
  }

  void WriterLeft(const Handle& writer) BAUDGATE_REQUIRES(calling_) {
    for (auto at = known_.begin(); at != known_.end();) {
      if (at->second.writer == writer) {
        if (on_gone_) on_gone_(at->second.sample, Gone::no_writers);
        at = known_.erase(at);
      } else {
        ++at;
      }
    }
  }

  Mutex& calling_;
  const OnSample on_sample_;
  const OnGone on_gone_;
  const std::function<void(int)> on_gateways_;
  const std::function<void(std::uint64_t)> on_rejected_;
  std::unordered_map<Handle, Known, HandleHash> known_ BAUDGATE_GUARDED_BY(calling_);
  Sample sample_ BAUDGATE_GUARDED_BY(calling_);
  std::map<Handle, int> gateways_ BAUDGATE_GUARDED_BY(calling_);  ///< writers of each
};

}  // namespace

struct DdsSubscriber::Impl {
  Impl(fast::DomainParticipant* made, SubscriberCallbacks callbacks)
      : participant(made),
        points(calling, std::move(callbacks.on_point), std::move(callbacks.on_point_gone),
               std::move(callbacks.on_gateways), std::move(callbacks.on_rejected)),
        devices(calling, std::move(callbacks.on_device), std::move(callbacks.on_device_gone), {},
                {}),
        gateways(calling, std::move(callbacks.on_gateway), std::move(callbacks.on_gateway_gone), {},
                 {}) {}
  ~Impl() { DeleteParticipant(participant); }

  bool Open(std::size_t max_instances) {
    subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    return subscriber != nullptr &&
           OpenReader(NewPointType(), kPointTopic, max_instances, &points) &&
           OpenReader(NewDeviceType(), kDeviceTopic, max_instances, &devices) &&
           OpenReader(NewGatewayType(), kGatewayTopic, max_instances, &gateways);
  }

  bool OpenReader(fast::TopicDataType* type, const char* topic_name, std::size_t max_instances,
                  fast::DataReaderListener* listener) {
    const fast::TypeSupport support(type);
    if (support.register_type(participant) != ReturnCode_t::RETCODE_OK) return false;
    auto* topic =
        participant->create_topic(topic_name, support.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    if (topic == nullptr) return false;
    return subscriber->create_datareader(topic, ReaderQos(max_instances), listener) != nullptr;
  }

  Mutex calling;
  fast::DomainParticipant* participant;
  fast::Subscriber* subscriber = nullptr;
  Inbox<PointSample> points;
  Inbox<DeviceSample> devices;
  Inbox<GatewaySample> gateways;
};

DdsSubscriber::DdsSubscriber(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DdsSubscriber::~DdsSubscriber() = default;

DatagramCounters DdsSubscriber::datagrams() const { return DatagramsOf(*impl_->participant); }

Result<std::unique_ptr<DdsSubscriber>> DdsSubscriber::Create(const SubscriberOptions& options,
                                                             SubscriberCallbacks callbacks) {
  auto participant = CreateParticipant(options.participant);
  if (!participant) return Error{participant.error()};
  auto impl = std::make_unique<Impl>(*participant, std::move(callbacks));
  if (!impl->Open(options.max_instances)) return Error{"dds: no readers could be made"};
  return std::unique_ptr<DdsSubscriber>(new DdsSubscriber(std::move(impl)));
}

}  // namespace baudgate::dds
