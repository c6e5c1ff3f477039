// Tests of `DatagramCheck`: captured datagrams, their truncations, and the known attacks.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/datagram_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/gateway/outputs/dds/datagrams.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

using testing::AnnouncementOf;
using testing::Captured;
using testing::Gap;
using testing::Heartbeat;
using testing::kFar;
using testing::kPublications;
using testing::Rtps;

constexpr Sender kPeer{0x0A000001, 40000};

constexpr char kSamples[] = "00 00 02 07 00 00 01 02";

Refusal Reason(const Bytes& datagram) {
  DatagramCheck check{CheckOptions{}};
  return check.Check(datagram, kPeer, kStart).reason;
}

TEST(DatagramCheck, AdmitsDatagramsOfCorrectPeers) {
  ASSERT_GE(Captured().size(), 22U);
  DatagramCheck one{CheckOptions{}};
  for (const auto& [name, bytes] : Captured()) {
    EXPECT_EQ(Reason(bytes), Refusal::none) << name;
    EXPECT_EQ(one.Check(bytes, kPeer, kStart).reason, Refusal::none) << name << " after others";
  }
}

TEST(DatagramCheck, RemovesATrailingVendorSubmessage) {
  const Bytes& bytes = Captured().at("fast_heartbeat");
  DatagramCheck check{CheckOptions{}};
  EXPECT_EQ(check.Check(bytes, kPeer, kStart).length, bytes.size() - 60);
  const Bytes& cyclone = Captured().at("cyclone_heartbeats");
  EXPECT_EQ(check.Check(cyclone, kPeer, kStart).length, cyclone.size());
  // Alone in a datagram, this vendor submessage made Fast DDS end its process, so only the header
  // must pass.
  Bytes statistics = Rtps("80 01 38 00");
  statistics.resize(statistics.size() + 57, 0xEE);
  statistics.resize(20 + 60);
  EXPECT_EQ(check.Check(statistics, kPeer, kStart).length, 20U);
}

// Each datagram is in a separate buffer, so AddressSanitizer finds a read beyond its end.
TEST(DatagramCheck, RefusesTruncatedDatagramsOrPassesWholeSubmessages) {
  for (const auto& [name, bytes] : Captured()) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      DatagramCheck check{CheckOptions{}};
      const Verdict verdict = check.Check(cut, kPeer, kStart);
      if (verdict.passes()) {
        EXPECT_LE(verdict.length, size) << name << ' ' << size;
        EXPECT_EQ(check.Check(View(cut).first(verdict.length), kPeer, kStart).reason, Refusal::none)
            << name << ' ' << size << ": what is passed on is right in itself";
      } else {
        EXPECT_NE(verdict.reason, Refusal::vendor_submessage) << name << ' ' << size;
      }
    }
  }
}

TEST(DatagramCheck, DamagedBytesAreNeverReadBeyondTheEnd) {
  std::mt19937 random(7);
  for (const auto& [name, right] : Captured()) {
    for (int round = 0; round < 2000; ++round) {
      Bytes bytes = right;
      for (unsigned damages = 1 + random() % 4; damages > 0; --damages) {
        bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
      }
      DatagramCheck check{CheckOptions{}};
      const Verdict verdict = check.Check(bytes, kPeer, kStart);
      EXPECT_LE(verdict.length, bytes.size());
      for (std::size_t i = 0; i < verdict.edit_count; ++i) {
        EXPECT_LE(verdict.edits[i].at + 8, verdict.length) << name;
      }
    }
  }
}

TEST(DatagramCheck, HidesTypeDescriptions) {
  // DATA of discovery. The parameters 69 00 and 72 00 are at the offsets 48 and 56.
  const Bytes bytes = Rtps(
      "15 05 2C 00 00 00 10 00 00 00 03 C7 00 00 03 C2 00 00 00 00 01 00 00 00 00 03 00 00 "
      "69 00 04 00 FF FF FF FF 72 00 04 00 EE EE EE EE 01 00 00 00");
  DatagramCheck check{CheckOptions{}};
  const Verdict verdict = check.Check(bytes, kPeer, kStart);
  ASSERT_TRUE(verdict.passes()) << Words(verdict.reason);
  ASSERT_EQ(verdict.hidden_count, 2U);
  EXPECT_EQ(verdict.hidden[0], 48);
  EXPECT_EQ(verdict.hidden[1], 56);
}

TEST(DatagramCheck, HidesMulticastGroupsForSamples) {
  const std::string address =
      " 18 00 01 00 00 00 E9 1C 00 00 00 00 00 00 00 00 00 00 00 00 00 00 EF FF 00 01 ";
  const auto hidden = [](const Bytes& bytes) {
    DatagramCheck check{CheckOptions{}};
    const Verdict verdict = check.Check(bytes, kPeer, kStart);
    EXPECT_TRUE(verdict.passes()) << Words(verdict.reason);
    std::vector<std::string> ids;
    for (std::size_t i = 0; i < verdict.hidden_count; ++i) {
      ids.push_back(ToHex(View(bytes).subspan(verdict.hidden[i], 2)));
    }
    return ids;
  };
  using ::testing::ElementsAre;
  EXPECT_THAT(hidden(AnnouncementOf(1, 20, "48 00" + address + "33 00" + address)),
              ElementsAre("48 00"))
      << "announcements go on by multicast";
  // Parameter 30 00 is the multicast group that a subscriber announces.
  EXPECT_THAT(hidden(Rtps("15 05 38 00 00 00 10 00 00 00 03 C7 00 00 03 C2 00 00 00 00 01 00 00 00 "
                          "00 03 00 00 30 00" +
                          address + "01 00 00 00")),
              ElementsAre("30 00"));
}

TEST(DatagramCheck, LimitsTheParametersOfAnEndpoint) {
  for (const std::size_t size : {8000U, 9000U}) {
    Bytes body = *ParseHex(
        "00 00 10 00 00 00 03 C7 00 00 03 C2 00 00 00 00 01 00 00 00 00 03 00 00 "
        "5A 00 10 00 01 02 03 04 05 06 07 08 09 0A 0B 0C 00 00 01 02");
    testing::Append32(body, static_cast<std::uint32_t>(0x2C | (size + 4) << 16));
    testing::Append32(body, static_cast<std::uint32_t>(size));
    body.resize(body.size() + size);
    testing::Append32(body, 1);
    Bytes bytes = Rtps("");
    Append(bytes, View(testing::Submessage(0x15, 0x04, body)));
    EXPECT_EQ(Reason(bytes), size == 8000 ? Refusal::none : Refusal::parameters);
  }
}

TEST(DatagramCheck, ReadersAndWritersOfAParticipantAreBounded) {
  DatagramCheck check{CheckOptions{.endpoints = {.of_participant = 2}}};
  ASSERT_TRUE(check.Check(AnnouncementOf(1), kPeer, kStart).passes());
  Instant now = kStart;
  const auto announce = [&](std::uint8_t entity, bool gone = false) {
    Bytes body = *ParseHex("00 00 10 00 00 00 03 C7 00 00 03 C2 00 00 00 00 01 00 00 00");
    const Bytes header = Rtps("", 1);
    if (gone) Append(body, View(*ParseHex("71 00 04 00 00 00 00 03 01 00 00 00")));
    Append(body, View(*ParseHex("00 03 00 00 5A 00 10 00")));
    Append(body, View(header).subspan(8));
    Append(body, View(Bytes{0, 0, entity, 2, 1, 0, 0, 0}));
    Bytes bytes = header;
    Append(bytes, View(testing::Submessage(0x15, gone ? 0x06 : 0x04, body)));
    return check.Check(bytes, kPeer, now += 1s).reason;
  };
  EXPECT_EQ(announce(1), Refusal::none);
  EXPECT_EQ(announce(2), Refusal::none);
  EXPECT_EQ(announce(3), Refusal::endpoints);
  EXPECT_EQ(announce(1), Refusal::none) << "it is there already";
  EXPECT_EQ(announce(1, true), Refusal::none);
  EXPECT_EQ(announce(3), Refusal::none);
}

struct Row {
  const char* what;
  Refusal reason;
  const char* hex;
};

constexpr char kDataStart[] = "00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 ";

TEST(DatagramCheck, NamesTheRefusalOfABrokenSubmessage) {
  const std::string data = kDataStart;
  const std::string discovery = "00 00 10 00 " + data + "00 03 00 00 ";
  const auto of = [](const std::string& hex) { return Rtps(hex); };
  EXPECT_EQ(Reason(of("")), Refusal::none) << "a header alone";
  for (const auto& [what, reason, hex] : {
           Row{"half a header of a submessage", Refusal::length, "15 05"},
           Row{"65535 bytes that are not there", Refusal::length, "15 05 FF FF 00 00 10 00"},
           Row{"the same in big-endian order", Refusal::length, "15 04 FF FF 00 00 10 00"},
           Row{"DATA shorter than its fields", Refusal::length,
               "15 05 10 00 00 00 10 00 00 01 00 C7 00 01 00 C2 00 00 00 00"},
           Row{"INFO_DST without a prefix", Refusal::length, "0E 01 04 00 00 00 00 00"},
           Row{"INFO_TS without a time", Refusal::length, "09 01 04 00 00 00 00 00"},
           Row{"INFO_TS that says there is none", Refusal::none, "09 03 00 00"},
           Row{"INFO_SRC without a prefix", Refusal::length, "0C 01 04 00 00 00 00 00"},
           Row{"DATA_FRAG with inline QoS and nothing behind (CVE-2023-50716)", Refusal::fragment,
               "16 03 24 00 00 00 1C 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 01 00 00 "
               "00 01 00 04 00 04 00 00 00 01 00 00 00"},
           Row{"HEARTBEAT_FRAG", Refusal::fragment, "13 01 04 00 00 00 00 00"},
           Row{"NACK_FRAG", Refusal::fragment, "12 01 04 00 00 00 00 00"},
           Row{"statistics before something else", Refusal::vendor_submessage,
               "80 01 04 00 00 00 00 00 0E 01 0C 00 00 00 00 00 00 00 00 00 00 00 00 00"},
           Row{"a submessage of a later standard", Refusal::none, "02 01 04 00 00 00 00 00"},
           Row{"padding", Refusal::none, "01 01 00 00 01 01 04 00 FF FF FF FF"},
           Row{"a secured submessage", Refusal::security, "31 01 04 00 00 00 00 00"},
           Row{"HEARTBEAT with the first after the last", Refusal::numbers,
               "07 01 1C 00 00 01 00 C7 00 01 00 C2 00 00 00 00 05 00 00 00 00 00 00 00 03 00 00 "
               "00 01 00 00 00"},
           Row{"HEARTBEAT below zero", Refusal::numbers,
               "07 01 1C 00 00 01 00 C7 00 01 00 C2 FF FF FF FF 05 00 00 00 00 00 00 80 00 00 00 "
               "00 01 00 00 00"},
           Row{"HEARTBEAT without its count", Refusal::length,
               "07 01 18 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 00 00 00 00 01 00 00 "
               "00"},
           Row{"ACKNACK of a set with 4294967295 numbers", Refusal::numbers,
               "06 01 18 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 FF FF FF FF 01 00 00 "
               "00"},
           Row{"ACKNACK whose bits are not there", Refusal::numbers,
               "06 01 18 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 00 01 00 00 01 00 00 "
               "00"},
           Row{"ACKNACK without its count", Refusal::length,
               "06 01 14 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 00 00 00 00"},
           Row{"GAP from zero", Refusal::numbers,
               "08 01 1C 00 00 01 00 C7 00 01 00 C2 00 00 00 00 00 00 00 00 00 00 00 00 01 00 00 "
               "00 00 00 00 00"},
           Row{"GAP cut short", Refusal::length, "08 01 0C 00 00 01 00 C7 00 01 00 C2 00 00 00 00"},
       }) {
    EXPECT_EQ(Reason(of(hex)), reason) << what << ": " << Words(Reason(of(hex)));
  }
  EXPECT_EQ(Reason({}), Refusal::not_rtps);
  EXPECT_EQ(Reason(*ParseHex("52 54 50 58 02 03 01 0F 00 00 00 00 00 00 00 00 00 00 00 00")),
            Refusal::not_rtps);
  EXPECT_EQ(Reason(*ParseHex("52 54 50 53 03 00 01 0F 00 00 00 00 00 00 00 00 00 00 00 00")),
            Refusal::not_rtps);
}

Bytes Data(std::uint8_t flags, const std::string& rest, std::uint16_t to_qos = 16) {
  Bytes body{0, 0, static_cast<std::uint8_t>(to_qos), static_cast<std::uint8_t>(to_qos >> 8)};
  Append(body, View(*ParseHex(kDataStart + rest)));
  Bytes bytes = Rtps("");
  Append(bytes, View(testing::Submessage(0x15, flags, body)));
  return bytes;
}

TEST(DatagramCheck, NamesTheRefusalOfBrokenData) {
  EXPECT_EQ(Reason(Data(0x04, "")), Refusal::data) << "payload that is not there";
  EXPECT_EQ(Reason(Data(0x06, "01 00 00 00")), Refusal::data) << "nor behind the inline QoS";
  EXPECT_EQ(Reason(Data(0x0C, "00 03 00 00 01 00 00 00")), Refusal::data) << "payload and key";
  EXPECT_EQ(Reason(Data(0x04, "00 03 00 00", 0xFFFF)), Refusal::data);
  EXPECT_EQ(Reason(Data(0x04, "00 03 00 00", 0)), Refusal::data);
  EXPECT_EQ(Reason(Data(0x02, "70 00 10 00 00 00 00 00")), Refusal::parameters) << "cut short";
  EXPECT_EQ(Reason(Data(0x02, "70 00 04 00 00 00 00 00 01 00 00 00")), Refusal::parameters)
      << "a key hash of four bytes";
  EXPECT_EQ(Reason(Data(0x04, "00 00 00 00 01 00 00 00")), Refusal::parameters)
      << "discovery data that are no parameter list";
  EXPECT_EQ(Reason(Data(0x04, "00 03 00 00 01 00 00 00")), Refusal::parameters)
      << "a participant without a name";
}

TEST(DatagramCheck, NamesTheRefusalOfABrokenAnnouncement) {
  const auto with = [](std::string_view further) { return Reason(AnnouncementOf(1, 20, further)); };
  EXPECT_EQ(with(""), Refusal::none);
  EXPECT_EQ(with("62 00 08 00 03 00 00 00 61 62 00 00"), Refusal::none) << "a name";
  EXPECT_EQ(with("62 00 08 00 05 00 00 00 61 62 00 00"), Refusal::parameters) << "a long one";
  EXPECT_EQ(with("2C 00 08 00 FF FF FF FF 00 00 00 00"), Refusal::parameters) << "user data";
  EXPECT_EQ(with("59 00 08 00 FF FF FF FF 00 00 00 00"), Refusal::parameters) << "properties";
  EXPECT_EQ(with("59 00 04 00 FF FF FF 0F"), Refusal::parameters) << "no room for a single one";
  EXPECT_EQ(with("59 00 14 00 01 00 00 00 02 00 00 00 61 00 00 00 02 00 00 00 62 00 00 00"),
            Refusal::none);
  EXPECT_EQ(with("29 00 08 00 02 00 00 00 00 00 00 00"), Refusal::parameters) << "partitions";
  EXPECT_EQ(with("73 00 08 00 FF FF FF FF 00 00 00 00"), Refusal::parameters) << "encodings";
  EXPECT_EQ(with("2F 00 08 00 01 00 00 00 00 00 00 00"), Refusal::parameters) << "half a locator";
  EXPECT_EQ(with("00 80 FF FF"), Refusal::parameters) << "65535 bytes";
  EXPECT_EQ(with("01 10 08 00 FF FF FF FF 00 00 00 00"), Refusal::security) << "an identity token";
  EXPECT_EQ(with("05 10 08 00 00 00 00 00 00 00 00 00"), Refusal::security);
  std::string many;
  for (int i = 0; i < 300; ++i) many += "00 00 00 00 ";
  EXPECT_EQ(with(many), Refusal::parameters) << "300 parameters";
  many.clear();
  for (int i = 0; i < 65; ++i) {
    many += "2F 00 18 00 01 00 00 00 39 30 00 00 00 00 00 00 00 00 00 00 00 00 00 00 7F 00 00 01 ";
  }
  EXPECT_EQ(with(many), Refusal::parameters) << "65 addresses";
}

TEST(DatagramCheck, ChecksSecurityTokensWhenSecurityIsOn) {
  const auto reason = [](std::string_view further) {
    DatagramCheck check{
        CheckOptions{.security = Secured::allowed, .participants = {}, .window = {}}};
    return check.Check(AnnouncementOf(1, 20, further), kPeer, kStart).reason;
  };
  EXPECT_EQ(reason("01 10 10 00 02 00 00 00 61 00 00 00 00 00 00 00 00 00 00 00"), Refusal::none);
  EXPECT_EQ(reason("01 10 0C 00 02 00 00 00 61 00 00 00 FF FF FF FF"), Refusal::parameters)
      << "4294967295 properties in a token";
  EXPECT_EQ(reason("01 10 10 00 02 00 00 00 61 00 00 00 00 00 00 00 FF FF FF FF"),
            Refusal::parameters)
      << "and binary ones";
}

constexpr char kHeader20[] = "00 00 00 02 00 00 00 01 00 00 00 02 00 00 00 03 00 00 00 04 ";

TEST(DatagramCheck, DemandsTheOrderOfSecuredSubmessages) {
  const std::string header = kHeader20;
  const std::string mac = "11 11 11 11 11 11 11 11 11 11 11 11 11 11 11 11 ";
  const std::string srtps_prefix = "33 01 14 00 " + header;
  const std::string prefix = "31 01 14 00 " + header;
  const std::string body = "30 01 08 00 00 00 00 04 AA BB CC DD ";
  const std::string srtps_postfix = "34 01 14 00 " + mac + "00 00 00 00 ";
  const std::string postfix = "32 01 14 00 " + mac + "00 00 00 00 ";
  const std::string heartbeat =
      "07 01 1C 00 00 00 03 C7 00 00 03 C2 00 00 00 00 01 00 00 00 00 00 00 00 01 00 00 00 01 00 "
      "00 00 ";
  const auto reason = [](const std::string& hex, Secured security = Secured::demanded) {
    DatagramCheck check{CheckOptions{.security = security, .participants = {}, .window = {}}};
    return check.Check(Rtps(hex), kPeer, kStart).reason;
  };
  for (const std::string& right :
       {srtps_prefix + body + srtps_postfix, prefix + body + postfix,
        srtps_prefix + prefix + body + postfix + srtps_postfix, prefix + heartbeat + postfix,
        srtps_prefix + heartbeat + heartbeat + srtps_postfix,
        prefix + body + postfix + prefix + body + postfix,
        "0E 01 0C 00 00 00 00 00 00 00 00 00 00 00 00 00 " + prefix + body + postfix}) {
    EXPECT_EQ(reason(right), Refusal::none) << right;
    EXPECT_EQ(reason(right, Secured::off), Refusal::security) << right;
  }
  for (const std::string& wrong :
       {srtps_prefix,
        srtps_prefix + body,
        body,
        postfix,
        srtps_postfix,
        prefix,
        prefix + body,
        prefix + postfix,
        prefix + body + body + postfix,
        prefix + prefix + body + postfix,
        prefix + body + heartbeat + postfix,
        heartbeat + srtps_prefix + body + srtps_postfix,
        srtps_prefix + srtps_prefix + body + srtps_postfix,
        srtps_prefix + body + srtps_postfix + body,
        srtps_prefix + prefix + srtps_postfix,
        "33 01 10 00 " + header.substr(12) + body + srtps_postfix,
        srtps_prefix + "30 01 08 00 00 00 00 05 AA BB CC DD " + srtps_postfix,
        srtps_prefix + "30 01 08 00 FF FF FF FF AA BB CC DD " + srtps_postfix,
        srtps_prefix + body + "34 01 14 00 " + mac + "00 00 00 01 ",
        srtps_prefix + body + "34 01 14 00 " + mac + "FF FF FF FF "}) {
    EXPECT_EQ(reason(wrong, Secured::allowed), Refusal::secured) << wrong;
  }
  const std::string statistics = "80 01 04 00 00 00 00 00 ";
  EXPECT_EQ(reason(srtps_prefix + body + srtps_postfix + statistics), Refusal::none);
  EXPECT_EQ(reason(srtps_prefix + heartbeat + statistics + srtps_postfix), Refusal::none);
  EXPECT_EQ(reason(statistics + heartbeat), Refusal::vendor_submessage);
  EXPECT_EQ(reason(heartbeat), Refusal::clear_text);
  EXPECT_EQ(reason(heartbeat, Secured::allowed), Refusal::none);
}

/// Returns a DDS Security handshake. `count`: the number of tokens that it claims to contain (4
/// bytes in hex).
Bytes HandshakeMessage(std::string_view count) {
  std::string hex = "00 00 10 00 00 02 01 C4 00 02 01 C3 00 00 00 00 01 00 00 00 00 01 00 00 ";
  for (int i = 0; i < 96; ++i) hex += "00 ";
  hex += "05 00 00 00 61 75 74 68 00 00 00 00 " + std::string(count);
  hex +=
      "02 00 00 00 61 00 00 00 00 00 00 00 01 00 00 00 02 00 00 00 63 00 00 00 "
      "04 00 00 00 DE AD BE EF ";
  Bytes bytes = Rtps("");
  Append(bytes, View(testing::Submessage(0x15, 0x04, *ParseHex(hex))));
  return bytes;
}

TEST(DatagramCheck, HandshakesAreBoundedInLengthAndRate) {
  DatagramCheck check{
      CheckOptions{.security = Secured::demanded, .participants = {}, .window = {}}};
  EXPECT_EQ(check.Check(HandshakeMessage("02 00 00 00 "), kPeer, kStart).reason, Refusal::secured);
  EXPECT_EQ(check.Check(HandshakeMessage("FF FF FF 0F "), kPeer, kStart).reason, Refusal::secured);
  const Bytes right = HandshakeMessage("01 00 00 00 ");
  int passed = 0;
  while (passed < 1000 && check.Check(right, kPeer, kStart).passes()) ++passed;
  EXPECT_EQ(passed, 256);
  EXPECT_EQ(check.Check(right, kPeer, kStart).reason, Refusal::handshakes);
  EXPECT_TRUE(check.Check(right, {kPeer.address + 1, 40000}, kStart).passes());
  EXPECT_TRUE(check.Check(right, kPeer, kStart + 20ms).passes());
  for (std::uint32_t i = 0; i < 1000; ++i) check.Check(right, {i, 40000}, kStart);
  EXPECT_EQ(check.Check(right, {5000, 40000}, kStart).reason, Refusal::handshakes)
      << "all addresses together";
}

TEST(DatagramCheck, RefusesALargeSequenceJumpInDiscovery) {
  EXPECT_EQ(Reason(Heartbeat(1, kPublications, kFar, kFar)), Refusal::window);
  EXPECT_EQ(Reason(Heartbeat(1, kPublications, 1, kFar)), Refusal::window);
  EXPECT_EQ(Reason(Gap(1, kPublications, 1, kFar)), Refusal::window);
  EXPECT_EQ(Reason(Gap(1, kPublications, kFar, 5)), Refusal::none) << "nothing to count";
  EXPECT_EQ(Reason(Heartbeat(1, kSamples, kFar, kFar)), Refusal::window);
  EXPECT_EQ(Reason(Heartbeat(1, kSamples, 3'000'000'000, 3'000'005'000)), Refusal::none)
      << "a gateway that has sent for years";
  EXPECT_EQ(Reason(Heartbeat(1, "00 02 00 C7 00 02 00 C2", 4'000'000, 4'000'000)), Refusal::none)
      << "a peer that has said for a year that it lives";
}

TEST(DatagramCheck, ALongLeaseIsShortened) {
  DatagramCheck check{CheckOptions{}};
  Bytes bytes = AnnouncementOf(1, 0x7FFFFFFF);
  const Verdict verdict = check.Check(bytes, kPeer, kStart);
  ASSERT_EQ(verdict.reason, Refusal::none);
  ASSERT_EQ(verdict.edit_count, 1U);
  const Edit& edit = verdict.edits[0];
  std::copy(edit.bytes.begin(), edit.bytes.end(),
            bytes.begin() + static_cast<std::ptrdiff_t>(edit.at));
  EXPECT_EQ(bytes, AnnouncementOf(1, 60));
  EXPECT_EQ(check.Check(bytes, kPeer, kStart).edit_count, 0U);
}

TEST(DatagramCheck, LimitsTheNumberOfParticipants) {
  DatagramCheck check{
      CheckOptions{.security = Secured::off, .participants = {.participants = 3}, .window = {}}};
  for (std::uint16_t number = 1; number <= 3; ++number) {
    EXPECT_EQ(check.Check(AnnouncementOf(number), kPeer, kStart).reason, Refusal::none);
  }
  EXPECT_EQ(check.Check(AnnouncementOf(4), kPeer, kStart).reason, Refusal::participants);
  EXPECT_EQ(check.Check(AnnouncementOf(2), kPeer, kStart).reason, Refusal::none) << "again";
  EXPECT_EQ(check.participants().size(), 3U);
  // Fast DDS announces the end of participant 2 by the hash of its key, without the key itself.
  Bytes leaves = Rtps("15 03 34 00 00 00 10 00 00 01 00 C7 00 01 00 C2 00 00 00 00 02 00 00 00", 2);
  Append(leaves, View(*ParseHex("70 00 10 00")));
  Append(leaves, View(Rtps("", 2)).subspan(8));
  Append(leaves, View(*ParseHex("00 00 01 C1 71 00 04 00 00 00 00 03 01 00 00 00")));
  EXPECT_EQ(check.Check(leaves, kPeer, kStart).reason, Refusal::none);
  EXPECT_EQ(check.participants().size(), 2U);
  EXPECT_EQ(check.Check(AnnouncementOf(4), kPeer, kStart + 1s).reason, Refusal::none);
}

// A discovery server forwards the announcements of many machines, so the limit must count the
// announced address.
TEST(DatagramCheck, CountsAForwardedAnnouncementForItsOwnAddress) {
  const auto of_one = [](std::uint16_t number, std::uint8_t last) {
    Bytes bytes = AnnouncementOf(number);
    bytes[bytes.size() - 5] = last;
    return bytes;
  };
  DatagramCheck check{CheckOptions{
      .servers = {kPeer}, .participants = {.of_address = 2}, .window = {}, .endpoints = {}}};
  for (std::uint16_t number = 1; number <= 20; ++number) {
    const auto last = static_cast<std::uint8_t>(number);
    EXPECT_EQ(check.Check(of_one(number, last), kPeer, kStart).reason, Refusal::none);
  }
  EXPECT_EQ(check.Check(of_one(30, 1), kPeer, kStart).reason, Refusal::none);
  EXPECT_EQ(check.Check(of_one(31, 1), kPeer, kStart).reason, Refusal::address);
  // Another sender has a limit of its own, even if only its port differs.
  const Sender another{kPeer.address, 5};
  EXPECT_EQ(check.Check(of_one(41, 41), another, kStart).reason, Refusal::none);
  EXPECT_EQ(check.Check(of_one(42, 42), another, kStart).reason, Refusal::none);
  EXPECT_EQ(check.Check(of_one(43, 43), another, kStart).reason, Refusal::address);
}

TEST(DatagramCheck, CountsAnAnnouncementFromAnyWriter) {
  DatagramCheck check{CheckOptions{}};
  Bytes bytes = AnnouncementOf(1);
  bytes[20 + 4 + 10] = 0x07;
  EXPECT_EQ(check.Check(bytes, kPeer, kStart).reason, Refusal::none);
  EXPECT_EQ(check.participants().size(), 1U);
}

TEST(DatagramCheck, TracksParticipantsThatConfirmedAnAnnouncement) {
  const std::string at =
      "32 00 18 00 01 00 00 00 F2 1C 00 00 00 00 00 00 00 00 00 00 00 00 00 00 0A "
      "00 00 01";
  const auto ack = [](const char* next) {
    return Rtps("06 01 18 00 00 00 03 C7 00 00 03 C2 00 00 00 00 " + std::string(next) +
                    " 00 00 00 00 01 00 00 00",
                1);
  };
  DatagramCheck check{CheckOptions{}};
  ASSERT_TRUE(check.Check(AnnouncementOf(1, 20, at), kPeer, kStart).passes());
  const Instant later = kStart + 6s;
  EXPECT_EQ(check.participants().Unanswered(later), (std::vector{UdpAddress{0x0A000001, 7410}}));
  ASSERT_TRUE(check.Check(ack("01 00 00 00"), kPeer, later).passes());
  EXPECT_TRUE(check.participants().Reached(later).empty()) << "it waits for the first";
  ASSERT_TRUE(check.Check(ack("02 00 00 00"), kPeer, later).passes());
  EXPECT_EQ(check.participants().Reached(later), (std::vector{UdpAddress{0x0A000001, 7410}}));
  EXPECT_TRUE(check.participants().Unanswered(later).empty());
}

}  // namespace
}  // namespace baudgate::dds
