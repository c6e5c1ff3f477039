// What a faulty or hostile peer can send: samples that break the contract, and datagrams that break
// RTPS. Nothing of it may end the process, and good samples must keep coming.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <random>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "gateway/outputs/dds/fast/participant.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/outputs/dds/fast/types.h"
#include "gateway/outputs/dds/published_types.h"
#include "gateway/outputs/dds/publisher.h"
#include "tests/gateway/outputs/dds/datagrams.h"
#include "tests/gateway/outputs/dds/fixture.h"

namespace baudgate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
using testing::DatagramSender;
using testing::MakeConfig;
using testing::Publish;
using testing::Published;
using testing::Rtps;
using testing::Set;
using testing::TestDomain;
using testing::TestSubscriber;

/// Bytes that go out as they are under the name of our type, each in an instance of its own.
struct Raw {
  Bytes bytes;
  std::uint8_t key = 0;
};

class RawType : public fast::TopicDataType {
 public:
  RawType() {
    setName("baudgate::v1::PointSample");
    m_typeSize = 1024;
    m_isGetKeyDefined = true;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }
  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    const Bytes& bytes = static_cast<Raw*>(data)->bytes;
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 1024U; };
  }
  void* createData() override { return new Raw; }
  void deleteData(void* data) override { delete static_cast<Raw*>(data); }
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle, bool) override {
    const Bytes& bytes = static_cast<Raw*>(data)->bytes;
    PointSample sample;
    const bool good = Decode(bytes, sample);
    const KeyHash hash = HashKey(sample);
    for (std::size_t i = 0; i < hash.size(); ++i) handle->value[i] = good ? hash[i] : 0xEE;
    handle->value[15] = static_cast<unsigned char>(static_cast<Raw*>(data)->key);
    return true;
  }
};

class HostileWriter {
 public:
  HostileWriter() : participant_(*CreateParticipant(TestSubscriber().participant)) {
    const fast::TypeSupport type(new RawType);
    type.register_type(participant_);
    auto* topic =
        participant_->create_topic(kPointTopic, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    fast::DataWriterQos qos;
    qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.reliable_writer_qos().times.heartbeatPeriod = {0, 100'000'000};
    qos.resource_limits().max_instances = 256;
    qos.resource_limits().max_samples = 256;
    qos.resource_limits().max_samples_per_instance = 1;
    writer_ =
        participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, qos);
  }
  ~HostileWriter() { DeleteParticipant(participant_); }

  bool Write(Raw raw) { return writer_->write(&raw); }

 private:
  fast::DomainParticipant* participant_;
  fast::DataWriter* writer_ = nullptr;
};

Bytes GoodBytes(const std::string& point) {
  PointSample sample;
  sample.gateway = "g", sample.device = "d", sample.point = point;
  Bytes bytes(512);
  bytes.resize(Encode(sample, bytes));
  return bytes;
}

TEST(Hostile, BrokenSamplesAreSkippedAndGoodOnesArrive) {
  Published heard;
  auto subscriber = DdsSubscriber::Create(TestSubscriber(), heard.Callbacks());
  ASSERT_TRUE(subscriber.ok());
  HostileWriter writer;
  std::uint8_t key = 0;
  ASSERT_TRUE(writer.Write({GoodBytes("first"), key++}));
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 1; }));
  Bytes other_encapsulation = GoodBytes("x");
  other_encapsulation[1] = 0x42;
  Bytes long_length = GoodBytes("x");
  long_length[7] = 0xFF;
  Bytes cut = GoodBytes("x");
  cut.resize(cut.size() / 2);
  for (const Bytes& bytes :
       {other_encapsulation, long_length, cut, Bytes{0, 1, 0, 0}, Bytes{9}, Bytes(700, 0xFF)}) {
    EXPECT_TRUE(writer.Write({bytes, key++}));
  }
  ASSERT_TRUE(writer.Write({GoodBytes("last"), key++}));
  EXPECT_TRUE(heard.WaitFor([&] { return heard.points.contains({"d", "last"}); }));
  EXPECT_EQ(heard.samples, 2U);
}

TEST(Hostile, BrokenDatagramsEndNothing) {
  const config::Config config = MakeConfig(1, 5);
  PointStore store(config);
  Published heard;
  auto subscriber = DdsSubscriber::Create(TestSubscriber(), heard.Callbacks());
  ASSERT_TRUE(subscriber.ok());
  const auto publisher = Publish(config, store);
  ASSERT_NE(publisher, nullptr);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 5; }));

  DatagramSender datagrams(TestDomain());
  for (const char* rest : {
           "",                         // a header alone
           "15 05",                    // half a DATA submessage
           "15 05 FF FF 00 00 10 00",  // that claims 65535 bytes
           "15 05 04 00 00 00 FF FF",  // inline QoS far beyond its end
           "15 07 18 00 00 00 10 00 00 01 00 C7 00 01 00 C2 FF FF FF FF FF FF FF FF 00 00 00 00",
           "07 01 1C 00 00 01 00 C7 00 01 00 C2 FF FF FF 7F FF FF FF FF 00 00 00 80 00 00 00 00 01 "
           "00 00 00",  // HEARTBEAT, first after last
           "06 01 14 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 FF FF FF FF",  // ACKNACK
           "16 01 20 00 00 00 1C 00 00 00 00 00 00 00 00 00 00 00 00 00 01 00 00 00 00 00 00 00 FF "
           "FF "
           "FF FF FF FF FF FF",  // DATA_FRAG with absurd sizes
           "12 01 08 00",        // HEARTBEAT_FRAG without a body
           "08 01 10 00 00 00 00 00 00 00 00 00 00 00 00 00 FF FF FF FF",  // GAP cut short
           "00 FF 00 00 00 00 00 00",                                      // PAD of unknown flags
       }) {
    datagrams.Send(Rtps(rest));
  }
  datagrams.Send({});
  datagrams.Send(Bytes(3, 'R'));
  std::mt19937 random(3);
  for (int round = 0; round < 2000; ++round) {
    Bytes noise = Rtps("15 05");
    const std::size_t size = random() % 300;
    for (std::size_t i = 0; i < size; ++i) noise.push_back(static_cast<std::uint8_t>(random()));
    datagrams.Send(noise);
  }

  Set(store, 0, 4, 4.5);
  EXPECT_TRUE(heard.WaitFor([&] { return heard.points[{"feeder-0", "p4"}].value == 4.5; }));
}

}  // namespace
}  // namespace baudgate::dds
