// Tests of `AnnouncementRelay` under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/discovery/announcement_relay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/gateway/outputs/dds/datagrams.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

using testing::Captured;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr std::uint32_t kPlant = 0x0A000000;

struct Who {
  std::uint16_t number = 0;
  std::uint32_t address = kPlant;
  std::uint16_t port = 7410;
  std::uint32_t lease = 20;
  std::string name = "one";

  UdpAddress at() const { return {address + number, port}; }
  UdpAddress sender() const { return {address + number, 40000}; }
};

void Put16(Bytes& bytes, std::size_t at, std::uint16_t number) {
  bytes[at] = static_cast<std::uint8_t>(number);
  bytes[at + 1] = static_cast<std::uint8_t>(number >> 8);
}

Bytes Of(const Who& who) {
  Bytes user_data{static_cast<std::uint8_t>(who.name.size()), 0, 0, 0};
  Append(user_data, who.name);
  user_data.resize((user_data.size() + 3) / 4 * 4);
  const Bytes header{0x2C, 0, static_cast<std::uint8_t>(user_data.size()), 0};
  Bytes bytes = testing::AnnouncementOf(who.number, who.lease, ToHex(header) + ToHex(user_data));
  const std::size_t locator = bytes.size() - 4 - user_data.size() - 4 - 24;
  Put16(bytes, locator + 4, who.port);
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[locator + 20 + i] = static_cast<std::uint8_t>((who.address + who.number) >> (24 - 8 * i));
  }
  return bytes;
}

std::vector<std::string> Texts(const Relayed& relayed) {
  std::vector<std::string> texts;
  for (const Introduction& one : relayed.introductions) {
    texts.push_back(std::to_string(one.datagram[18] * 256 + one.datagram[19]) + " to " +
                    Text(one.to));
  }
  return texts;
}

class Relay : public ::testing::Test {
 protected:
  std::vector<std::string> Hears(const Who& who) {
    const Bytes bytes = Of(who);
    const Relayed relayed = relay_.On(bytes, who.sender(), now_);
    refused_ = relayed.refused;
    return Texts(relayed);
  }
  std::size_t CountOf(const Who& who) { return Hears(who).size(); }

  AnnouncementRelay relay_;
  Instant now_ = kStart;
  std::string refused_;
};

TEST_F(Relay, ParticipantsAreIntroducedToEachOther) {
  EXPECT_THAT(Hears({.number = 1}), IsEmpty());
  EXPECT_THAT(Hears({.number = 2}),
              UnorderedElementsAre("1 to 10.0.0.2:7410", "2 to 10.0.0.1:7410"));
  EXPECT_THAT(Hears({.number = 3}),
              UnorderedElementsAre("1 to 10.0.0.3:7410", "2 to 10.0.0.3:7410", "3 to 10.0.0.1:7410",
                                   "3 to 10.0.0.2:7410"));
  EXPECT_EQ(relay_.participants(), 3U);
}

TEST_F(Relay, TheLatestAnnouncementIsForwarded) {
  Hears({.number = 1, .name = "one"});
  Hears({.number = 1, .name = "two"});
  const Bytes newcomer = Of({.number = 2});
  const Relayed relayed = relay_.On(newcomer, Who{.number = 2}.sender(), now_);
  ASSERT_EQ(relayed.introductions.size(), 2U);
  EXPECT_TRUE(
      std::ranges::equal(relayed.introductions[0].datagram, Of({.number = 1, .name = "two"})));
  EXPECT_TRUE(std::ranges::equal(relayed.introductions[1].datagram, newcomer));
}

TEST_F(Relay, AnAnnouncementIsForwardedThreeTimesThenEveryTenSeconds) {
  Hears({.number = 1});
  EXPECT_EQ(CountOf({.number = 2}), 2U);
  std::vector<std::string> heard_at;
  for (; now_ < kStart + 25s; now_ += 100ms) {
    Hears({.number = 1});
    if (CountOf({.number = 2}) == 1) heard_at.push_back(FormatDuration(now_ - kStart));
  }
  EXPECT_THAT(heard_at, ElementsAre("0s", "100ms", "10.1s", "20.1s"));
}

TEST_F(Relay, ALargeDomainHasLongerForwardingRounds) {
  for (std::uint16_t number = 1; number <= 100; ++number) Hears({.number = number, .lease = 60});
  for (int i = 0; i < 3; ++i) Hears({.number = 1, .lease = 60});
  now_ += 10s;
  EXPECT_EQ(CountOf({.number = 1, .lease = 60}), 0U);
  now_ += 10s;
  EXPECT_EQ(CountOf({.number = 1, .lease = 60}), 99U);
}

TEST_F(Relay, AChangedAnnouncementIsForwardedAtALimitedRate) {
  Hears({.number = 1});
  for (int i = 0; i < 3; ++i) Hears({.number = 2});
  now_ += 5s;
  EXPECT_THAT(Hears({.number = 2}), IsEmpty());
  EXPECT_THAT(Hears({.number = 2, .name = "two"}), ElementsAre("2 to 10.0.0.1:7410"));
  std::size_t told = 0;
  for (int i = 0; i < 10000; ++i) {
    told += CountOf({.number = 2, .name = i % 2 == 0 ? "one" : "two"});
    now_ += 1ms;
  }
  EXPECT_LE(told, 14U) << "one a second, after a burst of four";
  EXPECT_GE(told, 10U);
}

TEST_F(Relay, ParticipantsOfDifferentDomainsAreNotIntroduced) {
  Hears({.number = 1, .port = 7410});
  EXPECT_THAT(Hears({.number = 2, .port = 7660}), IsEmpty()) << "7400 + 250 is domain 1";
  EXPECT_EQ(CountOf({.number = 3, .port = 7649}), 2U) << "the last port of domain 0";
  EXPECT_THAT(Hears({.number = 4, .port = 80}), IsEmpty());
  EXPECT_EQ(refused_, "an announcement without a domain");
}

TEST_F(Relay, GatewaysAreNotIntroducedToEachOther) {
  const std::string publishes(UserDataOf(Role::publishes));
  const std::string subscribes(UserDataOf(Role::subscribes));
  Hears({.number = 1, .name = publishes});
  EXPECT_THAT(Hears({.number = 2, .name = publishes}), IsEmpty());
  EXPECT_EQ(CountOf({.number = 3, .name = subscribes}), 4U);
  EXPECT_EQ(CountOf({.number = 4, .name = subscribes}), 4U) << "to the gateways";
  EXPECT_EQ(CountOf({.number = 5}), 8U) << "who does not say what he does, to all";
}

TEST_F(Relay, AnAnnouncementWithAForeignAddressIsRefused) {
  Hears({.number = 1});
  const Bytes bytes = Of({.number = 2});
  const Relayed relayed = relay_.On(bytes, {kPlant + 99, 40000}, now_);
  EXPECT_THAT(relayed.introductions, IsEmpty());
  EXPECT_EQ(relayed.refused, "an announcement that does not name its sender's address");
  EXPECT_EQ(relay_.participants(), 1U);
}

TEST_F(Relay, AnotherMachineCannotTakeOverAParticipant) {
  Hears({.number = 1});
  Hears({.number = 2});
  EXPECT_THAT(Hears({.number = 2, .address = kPlant + 100}), IsEmpty());
  EXPECT_EQ(CountOf({.number = 3}), 4U);
  EXPECT_THAT(Hears({.number = 3}),
              UnorderedElementsAre("3 to 10.0.0.1:7410", "3 to 10.0.0.2:7410"));
}

TEST_F(Relay, ASilentParticipantIsForgottenAfterItsLease) {
  Hears({.number = 1, .lease = 3});
  now_ += 4s;
  EXPECT_EQ(CountOf({.number = 2, .lease = 100000}), 2U);
  now_ += 1ms;
  EXPECT_EQ(CountOf({.number = 3}), 2U) << "1 is gone, 2 is there";
  now_ = kStart + 64s;
  EXPECT_EQ(CountOf({.number = 4}), 2U) << "64 s after its last word 2 is there, 3 is gone";
  now_ += 1ms;
  EXPECT_EQ(CountOf({.number = 5}), 2U) << "a minute at most: only 4";
  EXPECT_EQ(relay_.participants(), 2U);
}

TEST_F(Relay, AGoodbyeDoesNotRemoveAParticipant) {
  const UdpAddress here{0x7F000001, 40000};
  EXPECT_EQ(relay_.On(Captured().at("fast_spdp_inline_qos"), here, now_).refused, "");
  ASSERT_EQ(relay_.participants(), 1U);
  EXPECT_EQ(relay_.On(Captured().at("fast_spdp_gone"), here, now_).refused, "");
  EXPECT_EQ(relay_.participants(), 1U);
}

TEST_F(Relay, TheNumberOfParticipantsIsLimited) {
  for (std::uint16_t number = 0; number < 600; ++number) {
    Hears({.number = number, .lease = 60});
    EXPECT_EQ(refused_, number < 512 ? "" : "too many participants");
  }
  EXPECT_EQ(relay_.participants(), 512U);
  Hears({.number = 7, .lease = 60});
  EXPECT_EQ(refused_, "") << "who has a place keeps it";
}

TEST_F(Relay, TheNumberOfParticipantsOfAnAddressIsLimited) {
  Hears({.number = 1000});
  for (std::uint16_t number = 0; number < 200; ++number) {
    Hears({.number = number, .address = 0x0A010000U - number, .lease = 1});
    EXPECT_EQ(refused_, number < 128 ? "" : "too many participants from one IP address");
  }
  now_ += 3s;
  std::size_t admitted = 0;
  for (std::uint16_t number = 200; number < 300; ++number) {
    Hears({.number = number, .address = 0x0A010000U - number, .lease = 1});
    admitted += refused_.empty() ? 1 : 0;
  }
  EXPECT_EQ(admitted, 24U);
}

TEST_F(Relay, TheRateOfForwardedAnnouncementsIsLimited) {
  RelayLimits limits;
  limits.to_address = {10, 2};
  limits.to_all = {16, 4};
  relay_ = AnnouncementRelay(limits);
  std::map<std::string, int> sent;
  for (std::uint16_t number = 0; number < 12; ++number) {
    for (const auto& text : Hears({.number = number, .address = kPlant - number})) {
      ++sent[text.substr(text.find("to "))];
    }
  }
  EXPECT_EQ(sent.at("to 10.0.0.0:7410"), 10);
  for (std::uint16_t number = 100; number < 110; ++number) {
    for (const auto& text : Hears({.number = number})) ++sent["all others " + text.substr(0, 0)];
  }
  EXPECT_EQ(sent.at("all others "), 6);
  now_ += 1s;
  EXPECT_EQ(CountOf({.number = 120}), 4U) << "of all, four a second";
}

TEST_F(Relay, ATooLongAnnouncementIsRefused) {
  Bytes bytes = Of({.number = 1});
  bytes.resize(4097);
  EXPECT_EQ(relay_.On(bytes, Who{.number = 1}.sender(), now_).refused,
            "an announcement that is too long");
}

}  // namespace
}  // namespace baudgate::dds
