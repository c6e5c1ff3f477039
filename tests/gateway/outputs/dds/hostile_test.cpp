// Tests of a hostile peer. It must not end the process, and good samples must still arrive.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <malloc.h>

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
#include "tests/gateway/outputs/dds/at_work.h"
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

TEST(Hostile, BrokenSamplesAreSkippedAndGoodSamplesArrive) {
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

TEST(Hostile, BrokenDatagramsDoNotStopThePublisher) {
  const config::Config config = MakeConfig(1, 5);
  bus::PointStore store(config);
  Published heard;
  auto subscriber = DdsSubscriber::Create(TestSubscriber(), heard.Callbacks());
  ASSERT_TRUE(subscriber.ok());
  const auto publisher = Publish(config, store);
  ASSERT_NE(publisher, nullptr);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 5; }));

  DatagramSender datagrams(TestDomain());
  for (const char* rest : {
           "",
           "15 05",
           "15 05 FF FF 00 00 10 00",  // DATA that claims 65535 bytes
           "15 05 04 00 00 00 FF FF",  // inline QoS far beyond its end
           "15 07 18 00 00 00 10 00 00 01 00 C7 00 01 00 C2 FF FF FF FF FF FF FF FF 00 00 00 00",
           "07 01 1C 00 00 01 00 C7 00 01 00 C2 FF FF FF 7F FF FF FF FF 00 00 00 80 00 00 00 00 01 "
           "00 00 00",  // HEARTBEAT, first after last
           "06 01 14 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 FF FF FF FF",  // ACKNACK
           "16 01 20 00 00 00 1C 00 00 00 00 00 00 00 00 00 00 00 00 00 01 00 00 00 00 00 00 00 FF "
           "FF "
           "FF FF FF FF FF FF",  // DATA_FRAG with absurd sizes
           "12 01 08 00",        // HEARTBEAT_FRAG without a body
           "08 01 10 00 00 00 00 00 00 00 00 00 00 00 00 00 FF FF FF FF",
           "00 FF 00 00 00 00 00 00",
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

using testing::AnnouncementOf;
using testing::Append32;

void AppendText(Bytes& to, std::uint16_t id, const std::string& text) {
  const std::size_t padded = (text.size() + 1 + 3) / 4 * 4;
  Append32(to, id | static_cast<std::uint32_t>(4 + padded) << 16);
  Append32(to, static_cast<std::uint32_t>(text.size() + 1));
  Append(to, text);
  to.resize(to.size() + padded - text.size());
}

/// Announces endpoints of participant 1. Endpoint numbers and sequence numbers both count from 1.
class Announcer {
 public:
  explicit Announcer(bool readers) : readers_(readers) {}

  /// Returns `count` more announcements in one datagram. `further` are more parameters in hex.
  Bytes More(std::size_t count, const std::string& topic, const std::string& further = "") {
    Bytes datagram = Rtps("", 1);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t number = ++number_;
      Bytes body = *ParseHex(readers_ ? "00 00 10 00 00 00 04 C7 00 00 04 C2 00 00 00 00"
                                      : "00 00 10 00 00 00 03 C7 00 00 03 C2 00 00 00 00");
      Append32(body, number);
      Append(body, View(*ParseHex("00 03 00 00 5A 00 10 00")));
      Append(body, View(Rtps("", 1)).subspan(8));
      for (const unsigned shift : {16U, 8U, 0U}) {
        body.push_back(static_cast<std::uint8_t>(number >> shift));
      }
      body.push_back(readers_ ? 0x07 : 0x02);
      AppendText(body, 0x05, topic.empty() ? "made/up/" + std::to_string(number) : topic);
      AppendText(body, 0x07, topic.empty() ? "Made" : "baudgate::v1::PointSample");
      Append(body, View(*ParseHex(further)));
      Append32(body, 1);
      Append(datagram, View(testing::Submessage(0x15, 0x04, body)));
    }
    return datagram;
  }

 private:
  const bool readers_;
  std::uint32_t number_ = 0;
};

class FloodTest : public testing::AtWork {
 protected:
  void SetUp() override {
    AtWork::SetUp();
    Send(AnnouncementOf(1));
  }
  DatagramCounters Counted() const { return publisher_->counters().datagrams; }
  void Send(const Bytes& datagram) {
    const auto seen = [this] { return Counted().passed + Counted().AllRefused(); };
    const std::uint64_t before = seen();
    attacker_.Send(datagram);
    while (seen() == before) ASSERT_TRUE(SampleArrives());
  }
};

TEST_F(FloodTest, InventedWritersAndReadersAreLimited) {
  Announcer writers(false);
  Announcer readers(true);
  const std::size_t memory = mallinfo2().uordblks;
  for (int i = 0; i < 100; ++i) {
    Send(writers.More(100, ""));
    Send(readers.More(100, ""));
  }
  EXPECT_GT(Counted().Refused(Refusal::endpoints), 100U);
  EXPECT_LT(mallinfo2().uordblks, memory + (16U << 20));
  EXPECT_TRUE(SampleArrives());
}

TEST_F(FloodTest, AHundredCorrectReadersOfAParticipantAreMatched) {
  Send(Announcer(true).More(100, kPointTopic));
  while (publisher_->counters().subscribers.points != 101) ASSERT_TRUE(SampleArrives());
}

TEST_F(FloodTest, DamagedTypeDescriptionsDoNotStopThePublisher) {
  Announcer writers(false);
  for (const char* id : {"69", "72", "75"}) {
    for (const char* content : {"FF FF FF FF FF FF FF FF", "00 01 00 00 F2 51 00 00",
                                "00 01 00 00 00 00 00 10", "00 03 00 00 FF FF FF 7F"}) {
      Send(writers.More(1, "", std::string(id) + " 00 08 00 " + content));
      EXPECT_TRUE(SampleArrives()) << id << ' ' << content;
    }
  }
  EXPECT_EQ(Counted().AllRefused(), 0U) << "right peers announce types";
}

using testing::Gap;
using testing::Heartbeat;
using testing::kFar;
using testing::kPublications;

class GateTest : public testing::AtWork {
 protected:
  bool Until(const std::function<bool(const DatagramCounters&)>& holds) {
    const Instant deadline = std::chrono::steady_clock::now() + 20s;
    while (!holds(subscriber_->datagrams())) {
      if (std::chrono::steady_clock::now() > deadline || !SampleArrives()) return false;
    }
    return SampleArrives();
  }
  bool Refuses(Refusal reason, const Bytes& datagram) {
    const std::uint64_t before = subscriber_->datagrams().Refused(reason);
    attacker_.Send(datagram);
    return Until([&](const DatagramCounters& now) { return now.Refused(reason) > before; });
  }
  bool Announce(std::uint16_t first, std::uint16_t count, std::uint32_t lease_seconds) {
    const DatagramCounters before = subscriber_->datagrams();
    for (std::uint16_t i = 0; i < count; ++i) {
      attacker_.Send(AnnouncementOf(static_cast<std::uint16_t>(first + i), lease_seconds));
    }
    return Until([&](const DatagramCounters& now) {
      return now.passed + now.AllRefused() >= before.passed + before.AllRefused() + count;
    });
  }
};

TEST_F(GateTest, AFragmentWithoutPayloadIsRefused) {
  EXPECT_TRUE(
      Refuses(Refusal::fragment,
              Rtps("16 03 24 00 00 00 1C 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 "
                   "01 00 00 00 01 00 04 00 04 00 00 00 01 00 00 00")));
}

TEST_F(GateTest, InventedStatisticsAreHarmless) {
  ASSERT_TRUE(Announce(1, 1, 20));
  const std::uint64_t before = subscriber_->datagrams().passed;
  std::uint64_t bytes = 1000;
  for (const std::uint64_t sequence : {10, 11, 5, 3}) {
    Bytes body(40);
    testing::Append32(body, static_cast<std::uint32_t>(sequence));
    testing::Append32(body, 0);
    testing::Append32(body, static_cast<std::uint32_t>(bytes /= 7));
    body.resize(56);
    Bytes datagram = Rtps("", 1);
    Append(datagram, View(testing::Submessage(0x80, 0, body)));
    attacker_.Send(datagram);
  }
  EXPECT_TRUE(Until([&](const DatagramCounters& now) { return now.passed >= before + 4; }));
}

TEST_F(GateTest, AHugeSecurityTokenIsRefused) {
  EXPECT_TRUE(Refuses(
      Refusal::security,
      AnnouncementOf(1, 20, "01 10 10 00 02 00 00 00 61 00 00 00 00 00 00 10 00 00 00 10")));
}

TEST_F(GateTest, FarHeartbeatsAndGapsAreRefused) {
  ASSERT_TRUE(Announce(1, 1, 20));
  EXPECT_TRUE(Refuses(Refusal::window, Heartbeat(1, kPublications, kFar, kFar)));
  EXPECT_TRUE(Refuses(Refusal::window, Gap(1, kPublications, 1, kFar)));
}

TEST_F(GateTest, InventedParticipantsAreLimited) {
  ASSERT_TRUE(Announce(1, 100, 0x7FFFFFFF));
  const std::size_t memory = mallinfo2().uordblks;
  ASSERT_TRUE(Announce(101, 200, 0x7FFFFFFF));
  EXPECT_TRUE(Until([](const DatagramCounters& now) { return now.Refused(Refusal::address) > 0; }));
  EXPECT_LE(subscriber_->datagrams().participants, 128U) << "all have the same address";
  EXPECT_LT(mallinfo2().uordblks, memory + (8U << 20)) << "those that came last cost nothing";
  EXPECT_TRUE(SampleArrives());
}

}  // namespace
}  // namespace baudgate::dds
