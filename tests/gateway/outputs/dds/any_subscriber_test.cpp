// A generic reader over loopback: it knows no type of ours but what discovery tells.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/any_subscriber.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/outputs/dds/type_fields.h"
#include "tests/gateway/outputs/dds/fixture.h"

namespace baudgate::dds {
namespace {

using testing::MakeConfig;
using testing::Publish;
using testing::Set;
using testing::TestSubscriber;

class Collected {
 public:
  AnyCallbacks Callbacks() {
    return {.on_sample =
                [this](const AnySample& sample) {
                  const std::scoped_lock lock(mutex_);
                  samples_.push_back(sample);
                  changed_.notify_all();
                },
            .on_topic = {}};
  }
  /// The first sample of the topic in which the field reads so; without fields after 20 s.
  AnySample WaitFor(const std::string& topic, const std::string& field, const std::string& text) {
    const auto is_it = [&](const AnySample& sample) {
      return sample.topic == topic && std::ranges::any_of(sample.fields, [&](const AnyField& one) {
               return one.name == field && one.text == text;
             });
    };
    std::unique_lock lock(mutex_);
    auto found = samples_.end();
    changed_.wait_for(lock, std::chrono::seconds(20), [&] {
      found = std::ranges::find_if(samples_, is_it);
      return found != samples_.end();
    });
    return found == samples_.end() ? AnySample{} : *found;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<AnySample> samples_;
};

std::vector<std::string> NamesOf(const AnySample& sample) {
  std::vector<std::string> names;
  for (const AnyField& field : sample.fields) names.push_back(field.name);
  return names;
}

std::vector<std::string> NamesOf(const TypeDescription& type) {
  std::vector<std::string> names;
  for (const TypeField& field : type.fields) names.emplace_back(field.name);
  return names;
}

TEST(AnySubscriberTest, DecodesWhatIsAnnounced) {
  const config::Config config = MakeConfig(1, 2);
  PointStore store(config);
  Collected collected;
  const auto subscriber =
      AnySubscriber::Create(TestSubscriber().participant, collected.Callbacks());
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  const auto publisher = Publish(config, store);
  Set(store, 0, 1, 2.5);
  const AnySample point = collected.WaitFor(kPointTopic, "value", "2.5");
  EXPECT_EQ(point.type, "baudgate::v1::PointSample");
  ASSERT_EQ(NamesOf(point), NamesOf(kTypeOf<PointSample>));
  EXPECT_EQ(point.fields[0].text, "substation-7");
  EXPECT_EQ(point.fields[0].form, AnyField::Form::text);
  EXPECT_EQ(point.fields[2].text, "p1");
  EXPECT_EQ(point.fields[6].text, "192");
  EXPECT_EQ(point.fields[6].form, AnyField::Form::number);
  EXPECT_EQ(point.fields[8].text, "1");
  const AnySample device = collected.WaitFor(kDeviceTopic, "device", "feeder-0");
  EXPECT_EQ(NamesOf(device), NamesOf(kTypeOf<DeviceSample>));
  const AnySample gateway = collected.WaitFor(kGatewayTopic, "gateway", "substation-7");
  EXPECT_EQ(NamesOf(gateway), NamesOf(kTypeOf<GatewaySample>));
}

TEST(AnySubscriberTest, ALateOneGetsTheLatestOfAll) {
  const config::Config config = MakeConfig(1, 1);
  PointStore store(config);
  const auto publisher = Publish(config, store);
  Set(store, 0, 0, std::string("tripped"));
  Collected collected;
  const auto subscriber =
      AnySubscriber::Create(TestSubscriber().participant, collected.Callbacks());
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  const AnySample point = collected.WaitFor(kPointTopic, "text", "tripped");
  ASSERT_EQ(NamesOf(point), NamesOf(kTypeOf<PointSample>));
  EXPECT_EQ(point.fields[3].text, "nan");
  EXPECT_EQ(point.fields[3].form, AnyField::Form::none) << "JSON has no such number";
}

}  // namespace
}  // namespace baudgate::dds
