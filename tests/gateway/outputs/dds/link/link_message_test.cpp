// Tests of the messages between gateway and DDS process. The expected bytes were computed by
// another program.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/link_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/outputs/dds/published_types.h"

namespace baudgate::dds {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

LinkOpen AnOpen() {
  return {.gateway = "sub-7",
          .participant = {.domain = 7,
                          .interfaces = {"127.0.0.1", "::1"},
                          .lease = 15s,
                          .multicast = false,
                          .peers = {"10.0.0.7"},
                          .discovery_servers = {{"10.0.0.8", 11811}},
                          .reached = {{"10.0.0.9", 7410}}},
          .room = {.points = 5000, .devices = 31, .events = 5},
          .requests = true};
}

constexpr char kOpen[] =
    "01 07 4E 00 05 73 75 62 2D 37 07 00 00 00 98 3A 00 00 02 09 31 32 37 2E 30 2E 30 2E 31 03 3A "
    "3A "
    "31 00 01 08 31 30 2E 30 2E 30 2E 37 01 08 31 30 2E 30 2E 30 2E 38 23 2E "
    "01 08 31 30 2E 30 2E 30 2E 39 F2 1C 88 13 00 00 1F 00 00 00 01 05 00 00 00 00";
// The encoded counters of a DDS process. Readers: 3 of points, 2 of devices, 1 of events, 4 of
// alarms. Samples: 1,234 written, 2^32 refused. Dropped: 5 requests, 6 events. 7 participants,
// 12,345 datagrams. 16 reasons of refusal, two of which occurred: 38 fragments, and 2 participants
// beyond the limit for one IP address.
constexpr char kCounts[] =
    "42 07 D1 00 03 00 00 00 02 00 00 00 01 00 00 00 04 00 00 00 D2 04 00 00 00 00 00 00 00 00 00 "
    "00 01 00 00 00 05 00 00 00 00 00 00 "
    "00 06 00 00 00 00 00 00 00 07 00 00 00 39 30 00 "
    "00 00 00 00 00 10 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 26 "
    "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
    "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
    "00 02 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
    "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
    "01 08 31 30 2E 30 2E 30 2E 39 F2 1C 01 06 6E 6F 74 20 6D 65";

// An encoded write request. Writer 01 … 10 is not volatile; the request was published at
// 1,000,000,011 ns, before the gateway's reader was there, and received at 1,000,000,007 ns.
constexpr char kRequest[] =
    "43 07 8D 00 01 02 03 04 05 06 07 08 09 0A 0B 0C 0D 0E 0F 10 07 CA 9A 3B "
    "00 00 00 00 0B CA 9A 3B 00 00 00 00 03 00 01 00 00 06 00 00 00 73 75 62 2D 37 00 00 00 06 00 "
    "00 00 "
    "70 6C 63 2D 31 00 00 00 2A 00 00 00 00 00 00 00 09 00 00 00 66 65 65 64 "
    "65 72 2D 31 00 00 00 00 0E 00 00 00 73 65 74 74 69 6E 67 5F 67 72 6F 75 "
    "70 00 00 00 00 00 00 00 00 00 00 00 00 00 F0 3F 02 00 00 00 32 00 01 00 "
    "C4 09 00 00 00 00 00 00 80 D6 9D F9 82 EB E9 18";

WriteArrival AnArrival() {
  WriteArrival arrival;
  arrival.request = {.gateway = "sub-7",
                     .client = "plc-1",
                     .seq = 42,
                     .device = "feeder-1",
                     .point = "setting_group",
                     .value = 1,
                     .text = "2",
                     .confirm = true,
                     .deadline_ms = 2500,
                     .not_after_ns = 1795224874250000000};
  arrival.writer.publisher.bytes = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  arrival.writer.entity = {13, 14, 15, 16};
  arrival.received = Instant(1'000'000'007ns);
  arrival.published = WallTime(1'000'000'011ns);
  arrival.lasting = arrival.early = true;
  return arrival;
}

TEST(LinkMessage, RequestsAndRepliesAreEncodedAndDecoded) {
  const Bytes packet = EncodeRequest(AnArrival());
  EXPECT_EQ(ToHex(packet), kRequest);
  const auto message = ParseLink(packet);
  ASSERT_TRUE(message.ok()) << message.error();
  EXPECT_EQ(message->kind, LinkKind::request);
  const auto back = DecodeRequest(message->body);
  ASSERT_TRUE(back.ok()) << back.error();
  EXPECT_EQ(back->request, AnArrival().request);
  EXPECT_EQ(back->writer, AnArrival().writer);
  EXPECT_EQ(back->received, AnArrival().received);
  EXPECT_EQ(back->published, AnArrival().published);
  EXPECT_TRUE(back->lasting);
  EXPECT_TRUE(back->early);
  for (std::size_t size = 0; size < message->body.size(); ++size) {
    EXPECT_FALSE(DecodeRequest(message->body.first(size)).ok()) << size;
  }
  Bytes neither(message->body.begin(), message->body.end());
  neither[32] = 4;
  EXPECT_FALSE(DecodeRequest(neither).ok());
  WriteArrival beyond = AnArrival();
  beyond.request.point = std::string(kMaxKey + 1, 'p');
  EXPECT_TRUE(EncodeRequest(beyond).empty());

  const ReplySample reply{"sub-7", "plc-1", 42, "ok", "", 12345};
  Bytes answer(kMaxLinkMessage);
  answer.resize(EncodeSample(LinkKind::reply, reply, answer));
  EXPECT_EQ(ToHex(View(answer).first(8)), "06 07 38 00 00 01 00 00");
  ReplySample reply_back;
  ASSERT_TRUE(Decode(ParseLink(answer)->body, reply_back));
  EXPECT_EQ(reply_back, reply);
}

TEST(LinkMessage, OpenIsEncodedAndDecoded) {
  const Bytes packet = EncodeOpen(AnOpen());
  EXPECT_EQ(ToHex(packet), kOpen);
  const auto message = ParseLink(packet);
  ASSERT_TRUE(message.ok()) << message.error();
  EXPECT_EQ(message->kind, LinkKind::open);
  const auto open = DecodeOpen(message->body);
  ASSERT_TRUE(open.ok());
  EXPECT_EQ(open->gateway, "sub-7");
  EXPECT_EQ(open->participant.domain, 7);
  EXPECT_EQ(open->participant.interfaces, AnOpen().participant.interfaces);
  EXPECT_EQ(open->participant.lease, 15s);
  EXPECT_FALSE(open->participant.multicast);
  EXPECT_EQ(open->participant.peers, AnOpen().participant.peers);
  EXPECT_EQ(open->participant.discovery_servers, AnOpen().participant.discovery_servers);
  EXPECT_EQ(open->participant.reached, AnOpen().participant.reached);
  EXPECT_EQ(open->room.points, 5000U);
  EXPECT_EQ(open->room.devices, 31U);
  EXPECT_TRUE(open->requests);
  EXPECT_EQ(open->room.events, 5U);
}

TEST(LinkMessage, OpenWithSecurityIsEncodedAndDecoded) {
  LinkOpen open = AnOpen();
  open.participant.security = config::SecurityIn("/etc/d");
  open.participant.security.permissions_ca = "/etc/p.pem";
  open.participant.security.password_file = std::string(255, 'p');
  const Bytes packet = EncodeOpen(open);
  const auto back = DecodeOpen(ParseLink(packet)->body);
  ASSERT_TRUE(back.ok()) << back.error();
  const config::DdsSecurity& files = back->participant.security;
  EXPECT_EQ(files.ca, "/etc/d/ca.pem");
  EXPECT_EQ(files.permissions_ca, "/etc/p.pem");
  EXPECT_EQ(files.identity, "/etc/d/identity.pem");
  EXPECT_EQ(files.key, "/etc/d/key.pem");
  EXPECT_EQ(files.password_file, std::string(255, 'p'));
  EXPECT_EQ(files.governance, "/etc/d/governance.p7s");
  EXPECT_EQ(files.permissions, "/etc/d/permissions.p7s");
  const View body = ParseLink(packet)->body;
  for (std::size_t size = 0; size < body.size(); ++size) {
    EXPECT_FALSE(DecodeOpen(body.first(size)).ok()) << size;
  }
  // A damaged message must not open a link without security.
  Bytes six = packet;
  six[kLinkHeaderBytes + 0x4E - 1] = 6;
  EXPECT_FALSE(DecodeOpen(ParseLink(six)->body).ok());
  open.participant.security = {};
  Bytes none = EncodeOpen(open);
  none.back() = 7;
  for (int i = 0; i < 7; ++i) none.push_back(0);
  none[2] = static_cast<std::uint8_t>(none.size() - 4);
  EXPECT_FALSE(DecodeOpen(ParseLink(none)->body).ok());
}

TEST(LinkMessage, CountsAreEncodedAndDecoded) {
  LinkCounts counts{.subscribers = {3, 2, 1, 4},
                    .written = 1234,
                    .refused = 1ULL << 32,
                    .dropped = 5,
                    .events_dropped = 6};
  counts.datagrams.passed = 12345;
  counts.datagrams.participants = 7;
  counts.datagrams.refused[static_cast<std::size_t>(Refusal::fragment)] = 38;
  counts.datagrams.refused[static_cast<std::size_t>(Refusal::address)] = 2;
  counts.neighbours = {.reached = {{"10.0.0.9", 7410}}, .remarks = {"not me"}};
  EXPECT_EQ(ToHex(EncodeCounts(counts)), kCounts);
  const auto back = DecodeCounts(ParseLink(*ParseHex(kCounts))->body);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(*back, counts);
}

TEST(LinkMessage, SamplesAreEncodedAndDecoded) {
  PointSample point;
  point.gateway = "g", point.device = "d", point.point = "p", point.value = 2.5, point.seq = 9;
  Bytes packet(kMaxLinkMessage);
  packet.resize(EncodeSample(LinkKind::point, point, packet));
  EXPECT_EQ(ToHex(View(packet).first(8)), "02 07 48 00 00 01 00 00");
  PointSample back;
  ASSERT_TRUE(Decode(ParseLink(packet)->body, back));
  EXPECT_EQ(back, point);

  DeviceSample device;
  device.gateway = "g", device.device = "d", device.line = "l", device.exchanges = 7;
  packet.resize(kMaxLinkMessage);
  packet.resize(EncodeSample(LinkKind::device, device, packet));
  const auto message = ParseLink(packet);
  ASSERT_TRUE(message.ok());
  EXPECT_EQ(message->kind, LinkKind::device);
  DeviceSample device_back;
  ASSERT_TRUE(Decode(message->body, device_back));
  EXPECT_EQ(device_back, device);

  const GatewaySample gateway{"g", -1, "1.2.3"};
  packet.resize(kMaxLinkMessage);
  packet.resize(EncodeSample(LinkKind::gateway, gateway, packet));
  EXPECT_EQ(ToHex(View(packet).first(8)), "04 07 1E 00 00 01 00 00");
  GatewaySample gateway_back;
  ASSERT_TRUE(Decode(ParseLink(packet)->body, gateway_back));
  EXPECT_EQ(gateway_back, gateway);
}

TEST(LinkMessage, EventsAreEncodedAndDecoded) {
  const EventSample event{"sub-7", "feeder-1", 4711, 1, 2, 3, 4, 5, "stage I> started"};
  Bytes packet(kMaxLinkMessage);
  packet.resize(EncodeSample(LinkKind::event, event, packet));
  EXPECT_EQ(ToHex(View(packet).first(8)), "07 07 59 00 00 01 00 00");
  const auto message = ParseLink(packet);
  ASSERT_TRUE(message.ok()) << message.error();
  EXPECT_EQ(message->kind, LinkKind::event);
  EventSample back;
  ASSERT_TRUE(Decode(message->body, back));
  EXPECT_EQ(back, event);
  EventSample beyond = event;
  beyond.text = std::string(kMaxText + 1, 't');
  packet.resize(kMaxLinkMessage);
  EXPECT_EQ(EncodeSample(LinkKind::event, beyond, packet), 0U);
}

TEST(LinkMessage, ASampleBeyondItsBoundsIsNotEncoded) {
  PointSample point;
  point.point = std::string(kMaxKey + 1, 'p');
  Bytes packet(kMaxLinkMessage);
  EXPECT_EQ(EncodeSample(LinkKind::point, point, packet), 0U);
  Bytes small(kMaxLinkMessage - 1);
  EXPECT_EQ(EncodeSample(LinkKind::point, PointSample(), small), 0U);
}

TEST(LinkMessage, TheLargestOpenFits) {
  LinkOpen open = AnOpen();
  open.gateway = std::string(kMaxKey, 'g');
  open.participant.interfaces.assign(64, std::string(45, '1'));
  open.participant.peers.assign(config::kMostPeers, std::string(15, '2'));
  open.participant.discovery_servers.assign(config::kMostDiscoveryServers,
                                            {std::string(15, '3'), 65535});
  const Bytes packet = EncodeOpen(open);
  EXPECT_LE(packet.size(), kMaxLinkMessage);
  const auto back = DecodeOpen(ParseLink(packet)->body);
  ASSERT_TRUE(back.ok());
  EXPECT_THAT(back->participant.interfaces, SizeIs(64));
  EXPECT_THAT(back->participant.peers, SizeIs(config::kMostPeers));
  EXPECT_EQ(back->participant.discovery_servers, open.participant.discovery_servers);
}

TEST(LinkMessage, AFailureTextIsShortenedAndMadePrintable) {
  const Bytes packet = EncodeFailed("no\nsuch " + std::string(2000, 'x'));
  const std::string sentence = DecodeFailed(ParseLink(packet)->body);
  EXPECT_THAT(sentence, SizeIs(1000));
  EXPECT_THAT(sentence, HasSubstr("no?such"));
}

/// Each prefix is in a separate buffer, so a sanitizer finds a read beyond the end.
TEST(LinkMessage, EveryTruncationIsRefused) {
  Bytes sample(kMaxLinkMessage);
  sample.resize(EncodeSample(LinkKind::point, PointSample(), sample));
  for (const Bytes& whole : {*ParseHex(kOpen), *ParseHex(kCounts), EncodeFailed("why"), sample}) {
    ASSERT_TRUE(ParseLink(whole).ok());
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const Bytes part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_FALSE(ParseLink(part).ok()) << size;
    }
  }
  const auto body_of = [](const char* hex, std::size_t size) {
    const Bytes whole = *ParseHex(hex);
    const auto body = View(whole).subspan(kLinkHeaderBytes).first(size);
    return Bytes(body.begin(), body.end());
  };
  for (std::size_t size = 0; size < 0x3E; ++size) {
    EXPECT_FALSE(DecodeOpen(body_of(kOpen, size)).ok()) << size;
  }
  for (std::size_t size = 0; size < 0xB1; ++size) {
    EXPECT_FALSE(DecodeCounts(body_of(kCounts, size)).ok()) << size;
  }
}

struct Wrong {
  const char* bytes;
  const char* words;
};

TEST(LinkMessage, AMalformedMessageIsNamedInTheError) {
  for (const Wrong& wrong : {
           Wrong{"", "0 bytes"},
           Wrong{"05 07 00", "3 bytes"},
           Wrong{"05 03 00 00", "version 3, not 7"},
           Wrong{"00 07 00 00", "unknown kind 0"},
           Wrong{"09 07 00 00", "unknown kind 9"},
           Wrong{"45 07 00 00", "unknown kind 69"},
           Wrong{"05 07 01 00", "0 bytes whose length field is 1"},
           Wrong{"05 07 00 01 00", "1 bytes whose length field is 256"},
       }) {
    const auto message = ParseLink(*ParseHex(wrong.bytes));
    ASSERT_FALSE(message.ok()) << wrong.bytes;
    EXPECT_THAT(message.error(), HasSubstr(wrong.words));
  }
  EXPECT_THAT(ParseLink(Bytes(kMaxLinkMessage + 1, 1)).error(), HasSubstr("too long"));
}

TEST(LinkMessage, CountsWithAnotherNumberOfReasonsAreRefused) {
  Bytes body = *ParseHex(kCounts);
  body.erase(body.begin(), body.begin() + kLinkHeaderBytes);
  ASSERT_TRUE(DecodeCounts(body).ok());
  body[60] = 14;
  EXPECT_FALSE(DecodeCounts(body).ok());
  body.resize(body.size() + 8);
  EXPECT_FALSE(DecodeCounts(body).ok());
}

TEST(LinkMessage, AnOpenBeyondItsBoundsIsRefused) {
  struct Change {
    std::size_t at;
    std::uint8_t byte;
  };
  const Bytes whole = *ParseHex(kOpen);
  const Bytes body(whole.begin() + kLinkHeaderBytes, whole.end());
  ASSERT_TRUE(DecodeOpen(body).ok());
  for (const Change& change :
       {Change{0, 65}, Change{6, 233}, Change{11, 1}, Change{12, 1}, Change{14, 65}, Change{15, 46},
        Change{29, 2}, Change{30, 65}, Change{40, 17}, Change{41, 16}, Change{52, 65},
        Change{53, 16}, Change{66, 0xFF}, Change{70, 0xFF}, Change{71, 2}, Change{75, 0xFF},
        Change{76, 6}}) {
    Bytes changed = body;
    changed[change.at] = change.byte;
    EXPECT_FALSE(DecodeOpen(changed).ok()) << change.at;
  }
  Bytes longer = body;
  longer.push_back(0);
  EXPECT_FALSE(DecodeOpen(longer).ok());
}

}  // namespace
}  // namespace baudgate::dds
