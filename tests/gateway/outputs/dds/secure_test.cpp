// Tests of DDS Security between participants of this process over loopback.
// SPDX-License-Identifier: Apache-2.0
#include <fastrtps/attributes/LibrarySettingsAttributes.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/outputs/dds/fast/participant.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "tests/gateway/outputs/dds/datagrams.h"
#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/sent_bytes.h"
#include "tests/gateway/outputs/dds/write_client.h"
#include "tests/gateway/outputs/pki/pki_folder.h"

namespace baudgate::dds {
namespace {

using eprosima::fastrtps::INTRAPROCESS_OFF;
using eprosima::fastrtps::LibrarySettingsAttributes;
using eprosima::fastrtps::xmlparser::XMLProfileManager;
using pki::testing::PkiFolder;
using testing::AnnouncementOf;
using testing::DatagramSender;
using testing::Eventually;
using testing::Gap;
using ::testing::HasSubstr;
using testing::Heartbeat;
using testing::kFar;
using testing::kPublications;
using testing::MakeConfig;
using testing::Publish;
using testing::Published;
using testing::Request;
using testing::Rtps;
using testing::SentBytes;
using testing::Set;
using testing::TestDomain;
using testing::TestSubscriber;
using testing::WriteClient;

class SecureTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(
        folder_.Make({"substation-7", "substation-8"}, 2, ReadClocks().wall, pki::kDemoValidity, 1)
            .ok());
    ASSERT_TRUE(stranger_.Make({"substation-7"}, 1, ReadClocks().wall).ok());
    config_.dds.security = folder_.Of("substation-7");
  }

  static SubscriberOptions With(const config::DdsSecurity& security) {
    SubscriberOptions options = TestSubscriber();
    options.participant.security = security;
    return options;
  }
  void Subscribe() {
    auto made = DdsSubscriber::Create(With(folder_.Of("subscriber-1")), heard_.Callbacks());
    ASSERT_TRUE(made.ok()) << made.error();
    subscriber_ = std::move(*made);
  }
  bool SampleArrives() {
    const double value = ++value_;
    Set(store_, 0, 0, value);
    return heard_.WaitFor([&] { return heard_.points[{"feeder-0", "p0"}].value == value; });
  }
  bool Refuses(Refusal reason, const Bytes& datagram) {
    const std::uint64_t before = subscriber_->datagrams().Refused(reason);
    attacker_.Send(datagram);
    const Instant deadline = std::chrono::steady_clock::now() + 20s;
    while (subscriber_->datagrams().Refused(reason) == before) {
      if (std::chrono::steady_clock::now() > deadline || !SampleArrives()) return false;
    }
    return SampleArrives();
  }

  const PkiFolder folder_{"secure"};
  const PkiFolder stranger_{"stranger"};
  config::Config config_ = MakeConfig(1, 1);
  bus::PointStore store_{config_};
  Published heard_;
  std::unique_ptr<DdsSubscriber> subscriber_;
  DatagramSender attacker_{TestDomain()};
  double value_ = 0;
};

TEST_F(SecureTest, OnlyTheRightCertificateGetsSamples) {
  const SubscriberOptions others[] = {TestSubscriber(), With(stranger_.Of("subscriber-1"))};
  Published unheard[2];
  std::vector<std::unique_ptr<DdsSubscriber>> strangers;
  for (std::size_t i = 0; i < 2; ++i) {
    auto made = DdsSubscriber::Create(others[i], unheard[i].Callbacks());
    ASSERT_TRUE(made.ok()) << made.error();
    strangers.push_back(std::move(*made));
  }
  const auto publisher = Publish(config_, store_);
  ASSERT_NE(publisher, nullptr);
  Subscribe();
  ASSERT_TRUE(SampleArrives());
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(SampleArrives());
  EXPECT_TRUE(heard_.WaitFor([&] { return heard_.gateways == 1; }));
  strangers.clear();
  for (const Published& none : unheard) {
    EXPECT_EQ(none.samples, 0U);
    EXPECT_EQ(none.gateways, 0);
  }
}

TEST_F(SecureTest, SamplesOfUntrustedGatewaysAreIgnored) {
  config::Config strange = config_;
  strange.dds.security = stranger_.Of("substation-7");
  strange.name = "strange";
  bus::PointStore strange_store{strange};
  config::Config open = config_;
  open.dds.security = {};
  open.name = "open";
  bus::PointStore open_store{open};
  const auto first = Publish(strange, strange_store);
  const auto second = Publish(open, open_store);
  const auto publisher = Publish(config_, store_);
  Subscribe();
  ASSERT_TRUE(SampleArrives());
  for (int i = 0; i < 20; ++i) {
    Set(strange_store, 0, 0, 1e6 + i);
    Set(open_store, 0, 0, 2e6 + i);
    EXPECT_TRUE(SampleArrives());
  }
  EXPECT_TRUE(heard_.WaitFor([&] {
    return heard_.gateways == 1 && heard_.points[{"feeder-0", "p0"}].gateway == "substation-7";
  }));
}

TEST_F(SecureTest, ParticipantsAreLimitedToTheirPermissions) {
  const auto subscribing =
      DdsSubscriber::Create(With(folder_.Of("substation-8")), heard_.Callbacks());
  ASSERT_FALSE(subscribing.ok());
  EXPECT_THAT(subscribing.error(), HasSubstr("cannot create readers; check that "));
  config_.dds.security = folder_.Of("subscriber-1");
  const auto publishing = CreateFastWriter(config_, store_);
  ASSERT_FALSE(publishing.ok());
  EXPECT_THAT(publishing.error(), HasSubstr("subscriber-1/permissions.p7s let this gateway "));
}

TEST_F(SecureTest, OnlyWriterCertificatesMayWrite) {
  config_.dds.write = true;
  auto gateway = CreateFastWriter(config_, store_);
  ASSERT_TRUE(gateway.ok()) << gateway.error();
  std::atomic<std::uint64_t> asked = 0;
  (*gateway)->OnRequest([&](const WriteArrival& arrival) { asked = arrival.request.seq; });
  const WriteClient subscriber(false, folder_.Of("subscriber-1"));
  EXPECT_FALSE(subscriber.made());
  const WriteClient other_gateway(false, folder_.Of("substation-8"));
  EXPECT_FALSE(other_gateway.made());
  WriteClient open;
  WriteClient writer(false, folder_.Of("writer-1"));
  ASSERT_TRUE(writer.made() && open.made());
  ASSERT_TRUE(Eventually([&] { return writer.matched(); }));
  open.Ask(Request(6));
  ASSERT_TRUE(writer.Ask(Request(7)));
  ASSERT_TRUE(Eventually([&] { return asked == 7; }));
  const ReplySample reply{"substation-7", "plc-1", 7, "ok", "", 42};
  EXPECT_EQ((*gateway)->Write(reply), Sent::yes);
  EXPECT_TRUE(Eventually([&] { return writer.Take() == reply; }));
  EXPECT_FALSE(open.matched());
  (*gateway)->OnRequest({});
}

TEST_F(SecureTest, InvalidFilesCreateNoParticipant) {
  const auto error = [&](config::DdsSecurity files) {
    auto made = CreateParticipant(With(files).participant);
    if (!made.ok()) return made.error();
    DeleteParticipant(*made);
    return std::string("there is one");
  };
  config::DdsSecurity files = folder_.Of("subscriber-1");
  files.key = folder_.In("subscriber-2/key.pem");
  EXPECT_THAT(error(files), HasSubstr("dds: security: key: "));
  files = folder_.Of("subscriber-1");
  files.ca = stranger_.In("ca/ca.pem");
  EXPECT_THAT(error(files), HasSubstr(" was not issued by "));
  files = folder_.Of("nobody");
  EXPECT_THAT(error(files), HasSubstr("nobody/ca.pem cannot be read: No such file"));
  const PkiFolder old("old");
  ASSERT_TRUE(old.Make({}, 1, ReadClocks().wall - 48h, 24h).ok());
  EXPECT_THAT(error(old.Of("subscriber-1")), HasSubstr("identity.pem expired on "));
  EXPECT_EQ(error({}), "there is one") << "open";
}

TEST_F(SecureTest, SamplesAreEncryptedOnTheWire) {
  // With intraprocess delivery, participants without security would exchange samples without the
  // network.
  LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = INTRAPROCESS_OFF;
  XMLProfileManager::library_settings(settings);
  config_.lines[0].devices[0].name = "plinthstation";
  bus::PointStore store{config_};
  const auto watched = [&](const config::DdsSecurity& gateway, const config::DdsSecurity& reader) {
    config_.dds.security = gateway;
    Published heard;
    const SentBytes sent;
    // The order of these two variables matters: Fast DDS 2.9 can end the process if the subscriber
    // leaves first, right after its handshake.
    auto subscriber = DdsSubscriber::Create(With(reader), heard.Callbacks());
    EXPECT_TRUE(subscriber.ok()) << subscriber.error();
    const auto publisher = Publish(config_, store);
    Set(store, 0, 0, std::string("zephyrvalue"));
    EXPECT_TRUE(heard.WaitFor([&] {
      return heard.points[{"plinthstation", "p0"}].text == "zephyrvalue";
    }));
    return sent.All();
  };
  const std::string open = watched({}, {});
  for (const char* text : {"plinthstation", "zephyrvalue", "PointSample"}) {
    EXPECT_NE(open.find(text), std::string::npos) << text << ": the test would see it";
  }
  const std::string secured = watched(folder_.Of("substation-7"), folder_.Of("subscriber-1"));
  EXPECT_GT(secured.size(), 1000U);
  for (const char* text :
       {"plinthstation", "zephyrvalue", "PointSample", "baudgate/points", "baudgate/devices"}) {
    EXPECT_EQ(secured.find(text), std::string::npos) << text;
  }
  // DDS Security does not encrypt these texts, as docs/dds.md says.
  for (const char* text : {"CN=substation-7", "-----BEGIN CERTIFICATE-----", "<publish>"}) {
    EXPECT_NE(secured.find(text), std::string::npos) << text;
  }
}

TEST_F(SecureTest, KnownAttacksAreRefusedWithSecurity) {
  const auto publisher = Publish(config_, store_);
  Subscribe();
  ASSERT_TRUE(SampleArrives());
  EXPECT_TRUE(
      Refuses(Refusal::fragment,
              Rtps("16 03 24 00 00 00 1C 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 "
                   "01 00 00 00 01 00 04 00 04 00 00 00 01 00 00 00")));
  EXPECT_TRUE(Refuses(
      Refusal::parameters,
      AnnouncementOf(1, 20, "01 10 10 00 02 00 00 00 61 00 00 00 00 00 00 10 00 00 00 10")));
  EXPECT_TRUE(Refuses(Refusal::clear_text, Heartbeat(1, kPublications, kFar, kFar)));
  EXPECT_TRUE(Refuses(Refusal::clear_text, Gap(1, kPublications, 1, kFar)));
  EXPECT_TRUE(Refuses(Refusal::window, Heartbeat(1, "00 01 00 C7 00 01 00 C2", kFar, kFar)));
  EXPECT_TRUE(Refuses(Refusal::secured, Rtps("33 01 04 00 00 00 00 00")));
  for (std::uint16_t i = 0; i < 300; ++i) attacker_.Send(AnnouncementOf(i, 0x7FFFFFFF));
  EXPECT_TRUE(Refuses(Refusal::address, AnnouncementOf(400, 0x7FFFFFFF)));
}

}  // namespace
}  // namespace baudgate::dds
