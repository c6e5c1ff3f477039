// Tests of Sparkplug B: the bytes against those of another encoder, and the edge node with a real
// mosquitto. docs/mqtt.md lists the rules of the specification that the tests check.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/sparkplug.h"

#include <gmock/gmock.h>

#include <atomic>
#include <future>
#include <thread>

#include "gateway/base/text.h"
#include "gateway/outputs/mqtt/session.h"
#include "tests/gateway/outputs/mqtt/fixture.h"
#include "tests/support/keeping_sink.h"
#include "tests/support/mqtt_broker.h"

namespace baudgate::mqtt {
namespace {

using sparkplug::DataType;
using sparkplug::Metric;
using sparkplug::QualityCode;
using ::testing::ElementsAre;
using ::testing::SizeIs;

// Made by the package sparkplug-payload 1.0.3 of npm, which also decodes it to these metrics.
constexpr char kForeign[] =
    "08fad9c1a28c34122b0a0763757272656e7410011880d8c1a28c3420094a100a075175616c697479120508031"
    "8c001650000444112190a026938108180401880d8c1a28c342001280150fbffffff0f12190a036936341880d8"
    "c1a28c34200458fbffffffffffffffff0112190a037536341880d8c1a28c34200858ffffffffffffffffff011"
    "2150a01641880d8c1a28c34200a699a9999999999b93f120e0a01621880d8c1a28c34200b700112120a017318"
    "80d8c1a28c34200c7a04c3a4c39f121f0a016e1880d8c1a28c34200638014a0f0a075175616c6974791204080"
    "318001807";

sparkplug::Payload Known() {
  constexpr std::uint64_t kTime = 1'790'000'000'000;
  const auto metric = [](const char* name, DataType type, Value value) {
    Metric one{.name = name, .timestamp = kTime, .type = type};
    one.value = std::move(value);
    return one;
  };
  sparkplug::Payload payload{kTime + 250, {}, 7};
  payload.metrics = {metric("current", DataType::float32, 12.25),
                     metric("i8", DataType::int8, std::int64_t{-5}),
                     metric("i64", DataType::int64, std::int64_t{-5}),
                     metric("u64", DataType::uint64, std::uint64_t{18'446'744'073'709'551'615U}),
                     metric("d", DataType::float64, 0.1),
                     metric("b", DataType::boolean, true),
                     metric("s", DataType::string, std::string("äß")),
                     metric("n", DataType::uint16, {})};
  payload.metrics[0].alias = 1;
  payload.metrics[0].quality = QualityCode::good;
  payload.metrics[1].alias = 1'048'577;
  payload.metrics[1].historical = true;
  payload.metrics[7].quality = QualityCode::bad;
  return payload;
}

std::string Foreign() {
  const auto bytes = ParseHex(kForeign);
  return {bytes->begin(), bytes->end()};
}

TEST(Sparkplug, WritesTheBytesOfAnotherEncoder) {
  EXPECT_EQ(sparkplug::Encode(Known()), Foreign());
}

TEST(Sparkplug, ReadsTheBytesOfAnotherEncoder) {
  const auto payload = sparkplug::Decode(Foreign());
  ASSERT_TRUE(payload);
  const sparkplug::Payload known = Known();
  EXPECT_EQ(payload->timestamp, known.timestamp);
  EXPECT_EQ(payload->seq, known.seq);
  ASSERT_THAT(payload->metrics, SizeIs(known.metrics.size()));
  for (std::size_t i = 0; i < known.metrics.size(); ++i) {
    const Metric& metric = payload->metrics[i];
    EXPECT_EQ(metric.name, known.metrics[i].name);
    EXPECT_EQ(metric.alias, known.metrics[i].alias);
    EXPECT_EQ(metric.timestamp, known.metrics[i].timestamp);
    EXPECT_EQ(metric.type, known.metrics[i].type);
    EXPECT_EQ(metric.historical, known.metrics[i].historical);
    EXPECT_EQ(metric.value, known.metrics[i].value) << metric.name;
  }
}

TEST(Sparkplug, DamagedBytesAreNoPayload) {
  const std::string bytes = Foreign();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    for (std::size_t at = 0; at < size; at += 7) {
      std::string damaged = bytes.substr(0, size);
      damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
      static_cast<void>(sparkplug::Decode(damaged));  // must not read beyond the bytes
    }
  }
  EXPECT_FALSE(sparkplug::Decode("\x12\x7F"));
  EXPECT_FALSE(sparkplug::Decode(std::string(20, '\xFF')));
}

/// An edge node "gate" of the group "baudgate" with the device "feeder".
class EdgeNode : public ::testing::Test {
 protected:
  struct Heard {
    std::string type;
    std::string device;
    sparkplug::Payload payload;
    bool retained;
  };

  EdgeNode() {
    config_.mqtt.payload = config::Mqtt::Payload::sparkplug;
    EXPECT_TRUE(broker_.Start());
    listener_ = std::make_unique<MqttListener>(broker_.port(), "spBv1.0/#");
  }
  ~EdgeNode() override { Stop(); }

  void Start() { session_.Start(config_, {store_, sink_}); }
  void Stop() { session_.Stop(); }
  std::vector<Heard> All() const {
    std::vector<Heard> all;
    for (const auto& message : listener_->messages()) {
      const auto levels = Split(message.topic, '/');
      const auto payload = sparkplug::Decode(message.payload);
      if (levels[1] == "STATE" || levels[2].ends_with("CMD") || !payload) continue;
      all.push_back({std::string(levels[2]),
                     levels.size() > 4 ? std::string(levels[4]) : std::string(), *payload,
                     message.retained});
    }
    return all;
  }
  std::vector<Heard> Of(const std::string& type) const {
    std::vector<Heard> some;
    for (const Heard& one : All()) {
      if (one.type == type) some.push_back(one);
    }
    return some;
  }
  bool Wait(const std::string& type, std::size_t count) const {
    return MqttListener::Wait([&] { return Of(type).size() >= count; }, 10s);
  }
  void Set(const Value& value) {
    const std::vector<bus::Sample> samples = {{0, value, Quality::good}};
    store_.Update(0, samples, ReadClocks(), 1ms);
  }
  void Command(const std::string& topic, const Metric& metric) {
    listener_->Publish(topic, sparkplug::Encode({1, {metric}, {}}));
  }

  MqttBroker broker_;
  config::Config config_ = testing::GatewayConfig(broker_.port());
  bus::PointStore store_{config_};
  KeepingSink sink_;
  std::unique_ptr<MqttListener> listener_;
  testing::RunningSession session_;
};

TEST_F(EdgeNode, IsBornWithItsDevicesAndSendsChangesByAlias) {
  Set(12.25);
  Start();
  ASSERT_TRUE(Wait("DBIRTH", 1));
  const auto all = All();
  ASSERT_GE(all.size(), 2U);
  EXPECT_EQ(all[0].type, "NBIRTH");
  EXPECT_FALSE(all[0].retained);
  EXPECT_EQ(all[0].payload.seq, 0U);
  ASSERT_THAT(all[0].payload.metrics, SizeIs(2));
  EXPECT_EQ(all[0].payload.metrics[0].name, "bdSeq");
  EXPECT_EQ(all[0].payload.metrics[0].value, Value(std::int64_t{0}));
  EXPECT_EQ(all[0].payload.metrics[1].name, "Node Control/Rebirth");
  EXPECT_EQ(all[0].payload.metrics[1].value, Value(false));
  EXPECT_EQ(all[1].type, "DBIRTH");
  EXPECT_EQ(all[1].device, "feeder");
  EXPECT_EQ(all[1].payload.seq, 1U);
  ASSERT_THAT(all[1].payload.metrics, SizeIs(4));
  const Metric current = all[1].payload.metrics[0];
  EXPECT_EQ(current.name, "current");
  EXPECT_EQ(current.value, Value(12.25));
  EXPECT_EQ(current.type, DataType::float32);
  EXPECT_EQ(all[1].payload.metrics[3].value, Value()) << "a bad value is null";
  Set(13.5);
  ASSERT_TRUE(Wait("DDATA", 1));
  const Heard data = Of("DDATA")[0];
  EXPECT_EQ(data.payload.seq, 2U);
  ASSERT_THAT(data.payload.metrics, SizeIs(1));
  EXPECT_EQ(data.payload.metrics[0].name, "");
  EXPECT_EQ(data.payload.metrics[0].alias, current.alias);
  EXPECT_EQ(data.payload.metrics[0].value, Value(13.5));
  EXPECT_FALSE(data.payload.metrics[0].historical);
  for (int i = 0; i < 300; ++i) {
    Set(20.0 + i);
    if (i % 10 == 0) std::this_thread::sleep_for(5ms);
  }
  ASSERT_TRUE(MqttListener::Wait(
      [&] { return Of("DDATA").back().payload.metrics[0].value == Value(319.0); }));
  std::uint64_t expected = 0;
  for (const Heard& one : All()) EXPECT_EQ(one.payload.seq, expected++ % 256) << one.type;
}

TEST_F(EdgeNode, DiesByItsWillAndByItself) {
  Start();
  ASSERT_TRUE(Wait("DBIRTH", 1));
  store_.SetOverride(0, Quality(Quality::bad_not_connected));
  ASSERT_TRUE(Wait("DDEATH", 1));
  EXPECT_THAT(Of("DDEATH")[0].payload.metrics, SizeIs(0));
  store_.SetOverride(0, std::nullopt);
  ASSERT_TRUE(Wait("DBIRTH", 2));
  Stop();
  ASSERT_TRUE(Wait("NDEATH", 1));
  const Heard death = Of("NDEATH")[0];
  EXPECT_FALSE(death.payload.seq);
  ASSERT_THAT(death.payload.metrics, SizeIs(1));
  EXPECT_EQ(death.payload.metrics[0].name, "bdSeq");
  EXPECT_EQ(death.payload.metrics[0].value, Value(std::int64_t{0}));
}

TEST_F(EdgeNode, IsBornAgainAtTheWishOfAHost) {
  Start();
  ASSERT_TRUE(Wait("DBIRTH", 1));
  Metric rebirth{.name = "Node Control/Rebirth", .type = DataType::boolean};
  rebirth.value = true;
  Command("spBv1.0/baudgate/NCMD/gate", rebirth);
  ASSERT_TRUE(Wait("DBIRTH", 2));
  const auto births = Of("NBIRTH");
  ASSERT_THAT(births, SizeIs(2));
  EXPECT_EQ(births[1].payload.seq, 0U);
  EXPECT_EQ(births[1].payload.metrics[0].value, births[0].payload.metrics[0].value)
      << "the number of the will";
}

TEST_F(EdgeNode, WritesByNameAndByAlias) {
  Start();
  ASSERT_TRUE(Wait("DBIRTH", 1));
  const auto alias = Of("DBIRTH")[0].payload.metrics[1].alias;
  Metric named{.name = "setting", .type = DataType::float32};
  named.value = 12.5;
  Command("spBv1.0/baudgate/DCMD/gate/feeder", named);
  Metric short_one{.alias = alias, .type = DataType::float32};
  short_one.value = 13.5;
  Command("spBv1.0/baudgate/DCMD/gate/feeder", short_one);
  Command("spBv1.0/baudgate/DCMD/gate/other", named);
  EXPECT_TRUE(MqttListener::Wait([&] { return session_->state().commands == 2; }));
  Stop();
  ASSERT_THAT(sink_.commands, SizeIs(2));
  EXPECT_EQ(ToDouble(sink_.commands[0].writes()[0].raw), 12.5);
  EXPECT_EQ(ToDouble(sink_.commands[1].writes()[0].raw), 13.5);
}

TEST_F(EdgeNode, StoredValuesAreHistoricalAndConfirmed) {
  Start();
  ASSERT_TRUE(Wait("DBIRTH", 1));
  ASSERT_TRUE(MqttListener::Wait([&] { return session_.connected(); }));
  outlet::Portion portion;
  for (const std::int64_t time : {1'790'000'000'000, 1'790'000'001'000}) {
    portion.values.push_back({"bay.feeder.current", {time, 1.5, Quality::good}, time});
  }
  portion.values.push_back({"bay.feeder.gone", {0, 1.5, Quality::good}, 0});
  std::promise<outlet::Answer> answered;
  session_->Send(portion, [&](outlet::Answer answer) { answered.set_value(std::move(answer)); });
  const outlet::Answer answer = answered.get_future().get();
  EXPECT_EQ(answer.kind, outlet::Answer::Kind::refused);
  EXPECT_THAT(answer.refused, ElementsAre(2));
  ASSERT_TRUE(Wait("DDATA", 1));
  const auto metrics = Of("DDATA").back().payload.metrics;
  ASSERT_THAT(metrics, SizeIs(2));
  EXPECT_TRUE(metrics[0].historical && metrics[1].historical);
  EXPECT_EQ(metrics[0].timestamp, 1'790'000'000'000U);
  EXPECT_EQ(metrics[1].timestamp, 1'790'000'001'000U);
}

TEST_F(EdgeNode, WaitsForItsPrimaryHost) {
  config_.mqtt.primary_host = "scada";
  Start();
  const std::string state = "spBv1.0/STATE/scada";
  ASSERT_TRUE(
      MqttListener::Wait([&] { return session_->state().phase == Client::Phase::connected; }));
  std::this_thread::sleep_for(150ms);
  EXPECT_TRUE(All().empty());
  listener_->Publish(state, R"({"online":true,"timestamp":100})", true);
  ASSERT_TRUE(Wait("NBIRTH", 1));
  listener_->Publish(state, R"({"online":false,"timestamp":99})");
  std::this_thread::sleep_for(150ms);
  EXPECT_TRUE(Of("NDEATH").empty()) << "an older STATE";
  listener_->Publish(state, R"({"online":false,"timestamp":101})", true);
  ASSERT_TRUE(Wait("NDEATH", 1)) << "by the will";
  listener_->Publish(state, R"({"online":true,"timestamp":102})", true);
  ASSERT_TRUE(Wait("NBIRTH", 2));
  EXPECT_EQ(Of("NBIRTH")[1].payload.metrics[0].value, Value(std::int64_t{1}));
}

}  // namespace
}  // namespace baudgate::mqtt
