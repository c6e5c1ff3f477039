// Tests of `ReadAnnouncement`: captured, damaged and misleading announcements.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/rtps/announcement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/gateway/outputs/dds/datagrams.h"

namespace baudgate::dds {
namespace {

using testing::Captured;
using testing::Rtps;

constexpr UdpAddress kHere{0x7F000001, 40000};

std::string WhyNot(const Bytes& datagram, UdpAddress sender = kHere) {
  const auto read = ReadAnnouncement(datagram, sender);
  return read ? "" : read.error();
}

TEST(Announcement, IsReadFromFastDdsAndCyclone) {
  const auto fast = ReadAnnouncement(Captured().at("fast_spdp"), kHere);
  ASSERT_TRUE(fast) << fast.error();
  EXPECT_FALSE(fast->leaves);
  EXPECT_EQ(fast->at, (UdpAddress{0x7F000001, 55660}));
  EXPECT_EQ(fast->domain, 193U) << "55660 = 7400 + 250 * 193 + 10: it does not say it";
  EXPECT_EQ(fast->lease, 4s);
  const auto cyclone = ReadAnnouncement(Captured().at("cyclone_spdp"), kHere);
  ASSERT_TRUE(cyclone) << cyclone.error();
  EXPECT_EQ(cyclone->at, (UdpAddress{0x7F000001, 54412}));
  EXPECT_EQ(cyclone->domain, 188U) << "it says so";
  EXPECT_EQ(cyclone->lease, 11s);
}

TEST(Announcement, OtherSubmessagesAreNotForwarded) {
  const Bytes& captured = Captured().at("fast_spdp");
  const auto read = ReadAnnouncement(captured, kHere);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->datagram.size(), captured.size() - 60) << "without the vendor's statistics";
  EXPECT_TRUE(std::ranges::equal(read->datagram, View(captured).first(read->datagram.size())));
  const auto again = ReadAnnouncement(read->datagram, kHere);
  ASSERT_TRUE(again) << "what is passed on is an announcement";
  EXPECT_EQ(again->datagram, read->datagram);
  // This fragment before the announcement, or behind it, makes Fast DDS 2.9.1 end its process.
  Bytes hidden = Rtps("16 03 24 00");
  hidden.resize(hidden.size() + 0x24);
  const Bytes right = testing::AnnouncementOf(7);
  const std::size_t header = 20;
  Append(hidden, View(right).subspan(header));
  Append(hidden, View(*ParseHex("16 03 04 00 00 00 00 00")));
  std::copy(right.begin(), right.begin() + header, hidden.begin());
  const auto clean = ReadAnnouncement(hidden, kHere);
  ASSERT_TRUE(clean) << clean.error();
  EXPECT_EQ(clean->datagram, right);
}

TEST(Announcement, BytesBehindItsParametersAreNotForwarded) {
  const Bytes right = testing::AnnouncementOf(7);
  Bytes longer = right;
  longer.resize(right.size() + 8, 0xEE);
  longer[22] = static_cast<std::uint8_t>(right[22] + 8);
  const auto read = ReadAnnouncement(longer, kHere);
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->datagram, right);
}

TEST(Announcement, ATimeStampDoesNotChangeItsContent) {
  Bytes first = Captured().at("fast_spdp");
  Bytes second = first;
  second[24] ^= 0xFF;
  const auto one = ReadAnnouncement(first, kHere);
  const auto other = ReadAnnouncement(second, kHere);
  ASSERT_TRUE(one && other);
  EXPECT_FALSE(std::ranges::equal(one->datagram, other->datagram));
  EXPECT_TRUE(std::ranges::equal(one->said(), other->said()));
}

TEST(Announcement, AGoodbyeIsRecognised) {
  const auto fast = ReadAnnouncement(Captured().at("fast_spdp_gone"), kHere);
  ASSERT_TRUE(fast) << fast.error();
  EXPECT_TRUE(fast->leaves);
  const auto cyclone = ReadAnnouncement(Captured().at("cyclone_spdp_gone"), kHere);
  ASSERT_TRUE(cyclone) << cyclone.error();
  EXPECT_TRUE(cyclone->leaves);
}

TEST(Announcement, MustContainTheAddressOfItsSender) {
  EXPECT_EQ(WhyNot(Captured().at("fast_spdp"), {0x0A000001, 40000}),
            "an announcement that does not name its sender's address");
  const Bytes two = testing::AnnouncementOf(
      7, 20, "32 00 18 00 01 00 00 00 F2 1C 00 00 00 00 00 00 00 00 00 00 00 00 00 00 0A 00 00 09");
  const auto there = ReadAnnouncement(two, {0x0A000009, 40000});
  ASSERT_TRUE(there) << there.error();
  EXPECT_EQ(there->at, (UdpAddress{0x0A000009, 7410}));
}

TEST(Announcement, OnBehalfOfAnotherParticipantIsRefused) {
  Bytes forged = testing::AnnouncementOf(7);
  forged[19] = 8;  // the prefix in the header becomes 8; the participant in the body stays 7
  EXPECT_EQ(WhyNot(forged), "an announcement on behalf of another participant");
  Bytes source = Rtps("0C 01 14 00 00 00 00 00 02 03 01 0F 01 0F AA BB CC DD 00 00 01 00 00 07", 7);
  Append(source, View(testing::AnnouncementOf(7)).subspan(20));
  EXPECT_EQ(WhyNot(source), "an announcement on behalf of another participant");
}

TEST(Announcement, OtherDatagramsAreRefused) {
  EXPECT_EQ(WhyNot({}), "not RTPS");
  EXPECT_EQ(WhyNot(Rtps("")), "no announcement of a participant");
  EXPECT_EQ(WhyNot(Rtps("15 05 FF FF")), "a length beyond the datagram");
  for (const auto& [name, bytes] : Captured()) {
    if (name.find("spdp") != std::string::npos) continue;
    EXPECT_EQ(WhyNot(bytes), "no announcement of a participant") << name;
  }
  Bytes elsewhere = testing::AnnouncementOf(7);
  elsewhere[20 + 4 + 4 + 2] = 0x03;
  EXPECT_EQ(WhyNot(elsewhere), "no announcement of a participant");
  EXPECT_EQ(WhyNot(testing::AnnouncementOf(
                7, 20, "01 10 10 00 02 00 00 00 61 00 00 00 00 00 00 10 00 00 00 00")),
            "a broken parameter list");
}

// Each copy is in a separate buffer, so AddressSanitizer finds a read beyond its end.
TEST(Announcement, WithDamageIsRefusedOrForwardedWhole) {
  std::mt19937 random(11);
  const std::vector<Bytes> right = {Captured().at("fast_spdp"), Captured().at("cyclone_spdp"),
                                    Captured().at("fast_spdp_inline_qos")};
  for (const Bytes& bytes : right) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      const auto read = ReadAnnouncement(cut, kHere);
      if (!read || read->leaves) continue;
      EXPECT_EQ(WhyNot(read->datagram), "") << size;
    }
    for (int round = 0; round < 5000; ++round) {
      Bytes damaged = bytes;
      for (unsigned damages = 1 + random() % 4; damages > 0; --damages) {
        damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
      }
      const auto read = ReadAnnouncement(damaged, kHere);
      if (!read || read->leaves) continue;
      EXPECT_LE(read->datagram.size(), damaged.size());
      EXPECT_EQ(WhyNot(read->datagram), "");
    }
  }
}

}  // namespace
}  // namespace baudgate::dds
