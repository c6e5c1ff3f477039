// Tests on which interfaces a gateway, a subscriber and `watch` find each other.
// SPDX-License-Identifier: Apache-2.0
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <sstream>

#include "gateway/outputs/dds/fast/participant.h"
#include "gateway/outputs/dds/fast/types.h"
#include "gateway/tools/watch/watch.h"
#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/own_network.h"

namespace baudgate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
using dds::testing::OwnNetwork;
using dds::testing::Published;
using ::testing::HasSubstr;

const std::string kLoopback = "127.0.0.1";
const std::string kInterface = OwnNetwork::kHere;
using Addresses = std::vector<std::string>;

class Stranger {
 public:
  explicit Stranger(const Addresses& interfaces) {
    fast::DomainParticipantQos qos;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = interfaces;
    qos.transport().user_transports.push_back(udp);
    qos.transport().use_builtin_transports = false;
    participant_ = fast::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<fast::DomainId_t>(dds::testing::TestDomain()), qos);
    const fast::TypeSupport type(dds::NewPointType());
    type.register_type(participant_);
    auto* topic =
        participant_->create_topic(dds::kPointTopic, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    fast::DataReaderQos reader;
    reader.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    reader.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
    reader_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
                  ->create_datareader(topic, reader);
  }
  ~Stranger() { dds::DeleteParticipant(participant_); }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  bool Hears() { return reader_->wait_for_unread_message({20, 0}); }

 private:
  fast::DomainParticipant* participant_;
  fast::DataReader* reader_;
};

class Interfaces : public ::testing::Test {
 protected:
  void SetUp() override {
    // With intraprocess delivery, the participants of this process would exchange samples without
    // the network.
    eprosima::fastrtps::LibrarySettingsAttributes settings;
    settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
    if (!network_.ok()) GTEST_SKIP() << "this user may not make network namespaces; root may";
  }
  std::unique_ptr<dds::DdsPublisher> PublishOn(Addresses interfaces, double value) {
    config_.dds.interfaces = std::move(interfaces);
    dds::testing::Set(store_, 0, 0, value);
    return dds::testing::Publish(config_, store_);
  }

  OwnNetwork network_;
  config::Config config_ = dds::testing::MakeConfig(1, 1);
  bus::PointStore store_{config_};
};

TEST_F(Interfaces, GatewayAndSubscriberOfAMachineNeedACommonInterface) {
  const Addresses both = {kLoopback, kInterface};
  const struct {
    Addresses gateway;
    std::vector<Addresses> subscribers;
  } rows[] = {
      {both, {{kLoopback}, {kInterface}, both, {}}},
      {{kLoopback}, {{kLoopback}, both, {}}},
      {{kInterface}, {{kInterface}, both, {}}},
      {{}, {{kLoopback}, {kInterface}, both, {}}},
  };
  for (const auto& row : rows) {
    const auto publisher = PublishOn(row.gateway, 2.5);
    for (const Addresses& interfaces : row.subscribers) {
      Published heard;
      auto options = dds::testing::TestSubscriber();
      options.participant.interfaces = interfaces;
      const auto subscriber = dds::DdsSubscriber::Create(options, heard.Callbacks());
      ASSERT_TRUE(subscriber.ok()) << subscriber.error();
      EXPECT_TRUE(heard.WaitFor([&] { return !heard.points.empty(); }))
          << ::testing::PrintToString(row.gateway) << ::testing::PrintToString(interfaces);
    }
  }
}

TEST_F(Interfaces, AMissingInterfaceLeavesTheOthersInUse) {
  const auto publisher = PublishOn({kLoopback, "192.0.2.9"}, 2.5);
  EXPECT_TRUE(Stranger({kLoopback}).Hears());
  const auto none = dds::CreateParticipant(
      {.domain = dds::testing::TestDomain(), .interfaces = {"192.0.2.9", "192.0.2.10"}}, nullptr,
      dds::Role::subscribes);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(
      none.error(),
      "dds: this machine has none of the addresses in dds.interfaces [192.0.2.9, 192.0.2.10]; "
      "ip -4 addr lists the addresses of this machine");
}

TEST_F(Interfaces, AParticipantOfAnotherLibraryHearsTheGateway) {
  const Addresses both = {kLoopback, kInterface};
  const struct {
    Addresses gateway;
    std::vector<Addresses> subscribers;
  } rows[] = {
      {both, {{}, both, {kInterface}}},
      {{kLoopback}, {{}, {kLoopback}, both}},
      {{kInterface}, {{kInterface}}},
      {{}, {{}, both, {kInterface}}},
  };
  for (const auto& row : rows) {
    const auto publisher = PublishOn(row.gateway, 2.5);
    for (const Addresses& interfaces : row.subscribers) {
      EXPECT_TRUE(Stranger(interfaces).Hears())
          << ::testing::PrintToString(row.gateway) << ::testing::PrintToString(interfaces);
    }
  }
}

class Steps : public std::stringbuf {
 public:
  struct Step {
    std::string seen;
    std::function<void()> then;
  };
  explicit Steps(std::vector<Step> steps) : steps_(std::move(steps)) {}
  int sync() override {
    if (next_ < steps_.size() && str().find(steps_[next_].seen) != std::string::npos) {
      steps_[next_++].then();
    }
    return 0;
  }
  bool Done() const { return next_ == steps_.size(); }

 private:
  const std::vector<Step> steps_;
  std::size_t next_ = 0;
};

class FarGateway : public Interfaces {
 protected:
  void Publish(double value) {
    network_.GoThere();
    publisher_ = PublishOn({OwnNetwork::kThere}, value);
    network_.ComeBack();
  }
  std::string Watch(std::vector<Steps::Step> steps) {
    Steps output(std::move(steps));
    tools::WatchOptions options;
    options.domain = dds::testing::TestDomain();
    options.interfaces = {kInterface};
    options.seconds = 20s;
    std::ostream out(&output);
    std::ostringstream err;
    EXPECT_EQ(RunWatch(options, out, err), 0);
    EXPECT_TRUE(output.Done()) << output.str();
    return err.str();
  }
  static void StopWatch() { pthread_kill(pthread_self(), SIGTERM); }

  std::unique_ptr<dds::DdsPublisher> publisher_;
};

TEST_F(FarGateway, IsReceivedAgainAfterItsInterfaceWasRecreated) {
  Publish(2.5);
  const auto renew = [this] {
    publisher_.reset();
    network_.RemoveCable();
    network_.AddCable();
    Publish(3.5);
  };
  EXPECT_THAT(Watch({{"2.500 A", renew}, {"3.500 A", StopWatch}}),
              HasSubstr("watch: the interface of " + kInterface + " was created again; "));
}

TEST_F(FarGateway, IsReceivedWhenTheCableIsPluggedInLate) {
  network_.Unplug();
  const auto begin = [this] {
    network_.PlugIn();
    Publish(2.5);
  };
  EXPECT_THAT(Watch({{"", begin}, {"2.500 A", StopWatch}}),
              HasSubstr("watch: the interface of " + kInterface + " is up now; watch restarts"));
}

}  // namespace
}  // namespace baudgate::dds
