// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/any_subscriber.h"

#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <fastrtps/types/DynamicDataFactory.h>
#include <fastrtps/types/DynamicPubSubType.h>

#include <deque>
#include <exception>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "gateway/base/worker.h"
#include "gateway/outputs/dds/fast/any_fields.h"
#include "gateway/outputs/dds/fast/participant.h"

namespace baudgate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace types = eprosima::fastrtps::types;
using types::ReturnCode_t;

constexpr std::int32_t kMostInstances = 100'000;

/// The library's own throws on a sample that its type does not fit.
class AnyType : public types::DynamicPubSubType {
 public:
  AnyType(const types::DynamicType_ptr& type, const std::string& name) : DynamicPubSubType(type) {
    setName(name.c_str());
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    try {
      return DynamicPubSubType::deserialize(payload, data);
    } catch (const std::exception&) {
      return false;
    }
  }
};

struct Offer {
  std::string type;
  fast::ReliabilityQosPolicyKind reliability = fast::BEST_EFFORT_RELIABILITY_QOS;
  fast::DurabilityQosPolicyKind durability = fast::VOLATILE_DURABILITY_QOS;
};

/// As much as its writer offers: the latest of what was written before, where it is kept.
fast::DataReaderQos QosFor(const Offer& offer) {
  fast::DataReaderQos qos;
  qos.reliability().kind = offer.reliability;
  qos.durability().kind = offer.durability == fast::VOLATILE_DURABILITY_QOS
                              ? fast::VOLATILE_DURABILITY_QOS
                              : fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 1;
  qos.resource_limits().max_instances = kMostInstances;
  qos.resource_limits().max_samples = kMostInstances;
  qos.resource_limits().max_samples_per_instance = 1;
  return qos;
}

class AnyReader : public fast::DataReaderListener {
 public:
  AnyReader(std::string topic, std::string type, types::DynamicType_ptr made, Mutex& calling,
            const AnyCallbacks& callbacks)
      : topic_(std::move(topic)),
        type_(std::move(type)),
        made_(std::move(made)),
        calling_(calling),
        callbacks_(callbacks) {}

  void on_data_available(fast::DataReader* reader) override {
    const MutexLock lock(calling_);
    const types::DynamicData_ptr data(
        types::DynamicDataFactory::get_instance()->create_data(made_));
    fast::SampleInfo info;
    while (reader->take_next_sample(data.get(), &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data && callbacks_.on_sample) {
        callbacks_.on_sample({topic_, type_, FieldsOf(*data, made_)});
      }
    }
  }

 private:
  const std::string topic_;
  const std::string type_;
  const types::DynamicType_ptr made_;
  Mutex& calling_;
  const AnyCallbacks& callbacks_;
};

}  // namespace

/// Discovery tells of writers and of types, in any order and on threads that must not make readers;
/// a thread of our own does.
struct AnySubscriber::Impl final : fast::DomainParticipantListener {
  explicit Impl(AnyCallbacks its_callbacks) : callbacks(std::move(its_callbacks)) {}

  Status Start(ParticipantOptions options) {
    options.types = true;
    auto made = CreateParticipant(options, this);
    if (!made) return Error{made.error()};
    participant = *made;
    subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    if (subscriber == nullptr) return Error{"dds: no subscriber could be made"};
    worker.Start();
    return {};
  }
  ~Impl() override {
    worker.Stop();
    if (participant != nullptr) DeleteParticipant(participant);
  }

  void on_publisher_discovery(fast::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override {
    using Info = eprosima::fastrtps::rtps::WriterDiscoveryInfo;
    if (info.status != Info::DISCOVERED_WRITER) return;
    const MutexLock lock(mutex);
    if (offers.size() >= kMostTopics * 2) return;
    offers[info.info.topicName().c_str()] = {info.info.typeName().c_str(),
                                             info.info.m_qos.m_reliability.kind,
                                             info.info.m_qos.m_durability.kind};
    worker.Wake();
  }
  void on_type_discovery(fast::DomainParticipant*, const eprosima::fastrtps::rtps::SampleIdentity&,
                         const eprosima::fastrtps::string_255& topic, const types::TypeIdentifier*,
                         const types::TypeObject*, types::DynamicType_ptr type) override {
    const MutexLock lock(mutex);
    if (type == nullptr || found.size() >= kMostTopics * 2) return;
    found.emplace(topic.c_str(), std::move(type));
    worker.Wake();
  }

  struct Topic {
    std::string name;
    Offer offer;
    types::DynamicType_ptr type;
  };
  Instant OpenNext() {
    const auto topic = NextTopic();
    if (!topic) return kWhenWoken;
    Open(*topic);
    return {};  // at once
  }
  /// The next whose writer and type are both known, and that is not read yet.
  std::optional<Topic> NextTopic() {
    const MutexLock lock(mutex);
    for (const auto& [name, type] : found) {
      if (!offers.contains(name) || !opened.insert(name).second) continue;
      return Topic{name, offers[name], type};
    }
    return std::nullopt;
  }
  void Open(const Topic& topic) {
    if (readers.size() >= kMostTopics) {
      return Tell(topic, "there are more than " + std::to_string(kMostTopics) + " topics");
    }
    Tell(topic, "");
    const fast::TypeSupport support(new AnyType(topic.type, topic.offer.type));
    if (support.register_type(participant) != ReturnCode_t::RETCODE_OK) {
      return Tell(topic, "its type cannot be used");
    }
    auto* const created =
        participant->create_topic(topic.name, topic.offer.type, fast::TOPIC_QOS_DEFAULT);
    readers.emplace_back(topic.name, topic.offer.type, topic.type, calling, callbacks);
    const auto qos = QosFor(topic.offer);
    if (created == nullptr ||
        subscriber->create_datareader(created, qos, &readers.back()) == nullptr) {
      Tell(topic, "no reader could be made");
    }
  }
  void Tell(const Topic& topic, const std::string& why) {
    const MutexLock lock(calling);
    if (callbacks.on_topic) callbacks.on_topic(topic.name, topic.offer.type, why);
  }

  const AnyCallbacks callbacks;
  fast::DomainParticipant* participant = nullptr;
  fast::Subscriber* subscriber = nullptr;
  Mutex calling;
  std::deque<AnyReader> readers;  // of the thread alone

  Mutex mutex;
  std::map<std::string, Offer> offers BAUDGATE_GUARDED_BY(mutex);
  std::map<std::string, types::DynamicType_ptr> found BAUDGATE_GUARDED_BY(mutex);
  std::set<std::string> opened BAUDGATE_GUARDED_BY(mutex);
  Worker worker{"dds topics", [this](bool last) { return last ? kWhenWoken : OpenNext(); }};
};

AnySubscriber::AnySubscriber(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AnySubscriber::~AnySubscriber() = default;

Result<std::unique_ptr<AnySubscriber>> AnySubscriber::Create(const ParticipantOptions& options,
                                                             AnyCallbacks callbacks) {
  auto impl = std::make_unique<Impl>(std::move(callbacks));
  if (const Status status = impl->Start(options); !status) return Error{status.error()};
  return std::unique_ptr<AnySubscriber>(new AnySubscriber(std::move(impl)));
}

}  // namespace baudgate::dds
