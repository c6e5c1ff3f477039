// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/types.h"

#include <algorithm>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include "gateway/outputs/dds/cdr.h"
#include "gateway/outputs/dds/fast/key_hash.h"
#include "gateway/outputs/dds/fast/type_objects.h"

namespace baudgate::dds {
namespace {

using eprosima::fastdds::dds::TopicDataType;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

// Not what fastddsgen makes: its code cuts long texts silently and ends the process of a subscriber
// on one sample with an unknown encapsulation.
template <typename Sample>
class SampleType : public TopicDataType {
 public:
  SampleType() {
    setName(("baudgate::v1::" + std::string(kTypeOf<Sample>.name)).c_str());
    m_typeSize = static_cast<std::uint32_t>(kMaxBytes<Sample>);
    m_isGetKeyDefined = true;
    DescribeType(kTypeOf<Sample>);
    auto_fill_type_information(false);
    auto_fill_type_object(true);
  }

  bool serialize(void* data, SerializedPayload_t* payload) override {
    const auto length = Encode(*static_cast<Sample*>(data), {payload->data, payload->max_size});
    if (length == 0) return false;
    payload->length = static_cast<std::uint32_t>(length);
    payload->encapsulation = CDR_LE;
    return true;
  }

  bool deserialize(SerializedPayload_t* payload, void* data) override {
    auto& sample = *static_cast<Sample*>(data);
    if (Decode({payload->data, payload->length}, sample)) return true;
    // Fast DDS 2.9 hands it out anyway when many are taken: what has no gateway is no sample.
    sample = Sample{};
    return false;
  }

  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return static_cast<std::uint32_t>(kMaxBytes<Sample>); };
  }

  void* createData() override { return new Sample; }
  void deleteData(void* data) override { delete static_cast<Sample*>(data); }

  bool getKey(void* data, InstanceHandle_t* handle, bool) override {
    const KeyHash hash = HashKey(*static_cast<Sample*>(data));
    for (std::size_t i = 0; i < hash.size(); ++i) handle->value[i] = hash[i];
    return true;
  }
};

}  // namespace

TopicDataType* NewPointType() { return new SampleType<PointSample>(); }

TopicDataType* NewDeviceType() { return new SampleType<DeviceSample>(); }

TopicDataType* NewGatewayType() { return new SampleType<GatewaySample>(); }

TopicDataType* NewEventType() { return new SampleType<EventSample>(); }

TopicDataType* NewAlarmType() { return new SampleType<AlarmSample>(); }

TopicDataType* NewRequestType() { return new SampleType<RequestSample>(); }

TopicDataType* NewReplyType() { return new SampleType<ReplySample>(); }

}  // namespace baudgate::dds
