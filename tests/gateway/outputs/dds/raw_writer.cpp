// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/outputs/dds/raw_writer.h"

#include <algorithm>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <sstream>
#include <string_view>

#include "gateway/outputs/dds/fast/participant.h"
#include "tests/gateway/outputs/dds/fixture.h"

namespace baudgate::dds::testing {
namespace {

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

class BytesType final : public fast::TopicDataType {
 public:
  explicit BytesType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 1024;
    m_isGetKeyDefined = true;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<Bytes*>(data);
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    const auto size = static_cast<std::uint32_t>(static_cast<Bytes*>(data)->size());
    return [size] { return size; };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void* data, InstanceHandle_t* handle, bool) override {
    const auto& bytes = *static_cast<Bytes*>(data);
    const std::size_t hash = std::hash<std::string_view>()(AsText(bytes));
    for (unsigned i = 0; i < 16; ++i) {
      handle->value[i] = static_cast<std::uint8_t>(hash >> (i % 8 * 8));
    }
    return true;
  }
};

}  // namespace

RawWriter::RawWriter(const std::string& topic_name, const std::string& type) {
  const auto made = CreateParticipant(TestSubscriber().participant);
  if (!made) return;
  participant_ = *made;
  const fast::TypeSupport support(new BytesType(type));
  support.register_type(participant_);
  auto* topic = participant_->create_topic(topic_name, type, fast::TOPIC_QOS_DEFAULT);
  auto* publisher = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  if (topic == nullptr || publisher == nullptr) return;
  fast::DataWriterQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  writer_ = publisher->create_datawriter(topic, qos);
}

RawWriter::~RawWriter() {
  if (participant_ != nullptr) DeleteParticipant(participant_);
}

bool RawWriter::Write(const Bytes& payload) {
  Bytes copy = payload;
  return writer_ != nullptr && writer_->write(&copy);
}

std::string RawWriter::guid() const {
  std::ostringstream text;
  if (writer_ != nullptr) text << writer_->guid();
  return text.str();
}

}  // namespace baudgate::dds::testing
