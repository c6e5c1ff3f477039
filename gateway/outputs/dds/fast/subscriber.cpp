// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/subscriber.h"

#include <algorithm>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <utility>

#include "gateway/outputs/dds/fast/inbox.h"
#include "gateway/outputs/dds/fast/participant.h"
#include "gateway/outputs/dds/fast/types.h"

namespace baudgate::dds {

Duration RestAfter(Duration round) { return std::clamp<Duration>(9 * round, 0ns, 50ms); }

TakingThread::TakingThread(std::function<Duration()> round)
    : round_(std::move(round)),
      worker_("dds take", [this](bool last) { return last ? kWhenWoken : Take(); }) {
  worker_.Start();
}

/// If the thread rests (RestAfter), it takes samples only after the rest.
void TakingThread::Wake() {
  if (!work_.exchange(true)) worker_.Wake();
}

Instant TakingThread::Take() {
  if (!work_) return kWhenWoken;
  if (ReadClocks().instant < rests_until_) return rests_until_;
  work_ = false;
  const Duration busy = round_();
  rests_until_ = ReadClocks().instant + RestAfter(busy);
  return kWhenWoken;
}

namespace {

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr std::size_t kEventDevices = 10'000;
constexpr std::size_t kAlarmsOfAllGateways = 100'000;

fast::DataReaderQos ReaderQos(std::size_t instances, std::size_t depth) {
  fast::DataReaderQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = static_cast<std::int32_t>(depth);
  qos.resource_limits().max_instances = static_cast<std::int32_t>(instances);
  qos.resource_limits().max_samples = static_cast<std::int32_t>(instances * depth);
  qos.resource_limits().max_samples_per_instance = static_cast<std::int32_t>(depth);
  qos.reader_resource_limits().max_samples_per_read = kTakenAtOnce;
  return qos;
}

}  // namespace

struct DdsSubscriber::Impl {
  Impl(fast::DomainParticipant* made, SubscriberCallbacks callbacks)
      : participant(made),
        taking([this] { return TakeAll(); }),
        points([this] { taking.Wake(); },
               {std::move(callbacks.on_point), std::move(callbacks.on_point_gone),
                std::move(callbacks.on_publisher_left), std::move(callbacks.on_gateways),
                std::move(callbacks.on_rejected)}),
        devices([this] { taking.Wake(); },
                {std::move(callbacks.on_device), std::move(callbacks.on_device_gone), {}, {}, {}}),
        gateways(
            [this] { taking.Wake(); },
            {std::move(callbacks.on_gateway), std::move(callbacks.on_gateway_gone), {}, {}, {}}),
        wants_events(callbacks.on_event),
        events([this] { taking.Wake(); }, {std::move(callbacks.on_event), {}, {}, {}, {}}),
        wants_alarms(callbacks.on_alarm),
        alarms([this] { taking.Wake(); },
               {std::move(callbacks.on_alarm), std::move(callbacks.on_alarm_gone), {}, {}, {}}) {}
  ~Impl() {
    taking.Stop();
    DeleteParticipant(participant);
  }

  bool Open(std::size_t max_instances) {
    subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    return subscriber != nullptr &&
           OpenReader(NewPointType(), kPointTopic, max_instances, &points) &&
           OpenReader(NewDeviceType(), kDeviceTopic, max_instances, &devices) &&
           OpenReader(NewGatewayType(), kGatewayTopic, max_instances, &gateways) &&
           (!wants_events ||
            OpenReader(NewEventType(), kEventTopic, kEventDevices, &events, kEventDepth)) &&
           (!wants_alarms ||
            OpenReader(NewAlarmType(), kAlarmTopic, kAlarmsOfAllGateways, &alarms));
  }

  /// Takes all samples, those of gateways first: they contain the start of the gateway, from which
  /// the `seq` of a point's samples counts.
  Duration TakeAll() {
    Duration busy = gateways.TakeAll();
    busy += points.TakeAll();
    busy += devices.TakeAll();
    busy += events.TakeAll();
    return busy + alarms.TakeAll();
  }

  bool OpenReader(fast::TopicDataType* type, const char* topic_name, std::size_t max_instances,
                  fast::DataReaderListener* listener, std::size_t depth = 1) {
    const fast::TypeSupport support(type);
    if (support.register_type(participant) != ReturnCode_t::RETCODE_OK) return false;
    auto* topic =
        participant->create_topic(topic_name, support.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    if (topic == nullptr) return false;
    return subscriber->create_datareader(topic, ReaderQos(max_instances, depth), listener) !=
           nullptr;
  }

  fast::DomainParticipant* participant;
  fast::Subscriber* subscriber = nullptr;
  TakingThread taking;  // the readers call it from their threads, and are created after all members
  Inbox<PointSample> points;
  Inbox<DeviceSample> devices;
  Inbox<GatewaySample> gateways;
  const bool wants_events;
  Inbox<EventSample> events;
  const bool wants_alarms;
  Inbox<AlarmSample> alarms;
};

DdsSubscriber::DdsSubscriber(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DdsSubscriber::~DdsSubscriber() = default;

DatagramCounters DdsSubscriber::datagrams() const { return DatagramsOf(*impl_->participant); }

SubscriberCounters DdsSubscriber::counters() const {
  return {impl_->points.takes() + impl_->devices.takes() + impl_->gateways.takes() +
              impl_->events.takes() + impl_->alarms.takes(),
          impl_->points.refused() + impl_->devices.refused() + impl_->gateways.refused() +
              impl_->events.refused() + impl_->alarms.refused()};
}

Result<std::unique_ptr<DdsSubscriber>> DdsSubscriber::Create(const SubscriberOptions& options,
                                                             SubscriberCallbacks callbacks) {
  auto participant = CreateParticipant(options.participant, nullptr, Role::subscribes);
  if (!participant) return Error{participant.error()};
  auto impl = std::make_unique<Impl>(*participant, std::move(callbacks));
  if (!impl->Open(options.max_instances)) {
    const auto& security = options.participant.security;
    return Error{std::string("dds: cannot create readers") +
                 (security.on() ? "; check that " + security.permissions +
                                      " let this subscriber subscribe baudgate/*"
                                : "")};
  }
  return std::unique_ptr<DdsSubscriber>(new DdsSubscriber(std::move(impl)));
}

}  // namespace baudgate::dds
