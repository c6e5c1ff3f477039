// Tests of requests and replies over loopback with the real Fast DDS.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/outputs/dds/published_types.h"
#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/raw_writer.h"
#include "tests/gateway/outputs/dds/write_client.h"

namespace baudgate::dds {
namespace {

using testing::Eventually;
using testing::RawWriter;
using testing::Request;
using testing::TestSubscriber;
using testing::WriteClient;

class Gateway {
 public:
  Gateway() {
    auto made = CreateFastWriter(TestSubscriber().participant, {.points = 10, .devices = 1},
                                 "substation-7");
    EXPECT_TRUE(made.ok()) << made.error();
    writer_ = std::move(*made);
    writer_->OnRequest([this](WriteArrival arrival) {
      const std::lock_guard lock(mutex_);
      arrived_.push_back(std::move(arrival));
    });
  }
  std::vector<WriteArrival> arrived() {
    const std::lock_guard lock(mutex_);
    return arrived_;
  }
  SampleWriter& writer() { return *writer_; }

 private:
  std::mutex mutex_;
  std::vector<WriteArrival> arrived_;
  std::unique_ptr<SampleWriter> writer_;
};

TEST(WriteTopics, ARequestArrivesWithItsWriterAndGetsAReply) {
  Gateway gateway;
  WriteClient client;
  ASSERT_TRUE(Eventually([&] { return client.matched(); }));
  ASSERT_TRUE(client.Ask(Request(1, "substation-8")));
  ASSERT_TRUE(client.Ask(Request(7)));
  ASSERT_TRUE(Eventually([&] { return !gateway.arrived().empty(); }));
  ASSERT_EQ(gateway.arrived().size(), 1U) << "the other is another gateway's";
  const WriteArrival arrival = gateway.arrived()[0];
  EXPECT_EQ(arrival.request, Request(7));
  EXPECT_EQ(arrival.writer, client.id());
  EXPECT_LE(arrival.received, std::chrono::steady_clock::now());

  const ReplySample reply{"substation-7", "plc-1", 7, "ok", "", 42};
  EXPECT_EQ(gateway.writer().Write(reply), Sent::yes);
  std::optional<ReplySample> heard;
  ASSERT_TRUE(Eventually([&] { return (heard = client.Take()).has_value(); }));
  EXPECT_EQ(*heard, reply);
}

TEST(WriteTopics, RequestsOfNonVolatileWritersAreMarkedAsLasting) {
  Gateway gateway;
  WriteClient lasting(true);
  WriteClient client;
  ASSERT_TRUE(Eventually([&] { return client.matched() && lasting.matched(); }));
  ASSERT_TRUE(lasting.Ask(Request(1)));
  ASSERT_TRUE(client.Ask(Request(2)));
  ASSERT_TRUE(Eventually([&] { return gateway.arrived().size() == 2; }));
  for (const WriteArrival& arrival : gateway.arrived()) {
    EXPECT_EQ(arrival.lasting, arrival.request.seq == 1);
  }
}

TEST(WriteTopics, ARequestSentBeforeTheGatewayStartedNeverArrives) {
  WriteClient early(true);
  ASSERT_TRUE(early.Ask(Request(1)));
  Gateway gateway;
  ASSERT_TRUE(Eventually([&] { return early.matched(); }));
  ASSERT_TRUE(early.Ask(Request(2)));
  ASSERT_TRUE(Eventually([&] { return !gateway.arrived().empty(); }));
  EXPECT_EQ(gateway.arrived()[0].request.seq, 2U);
  EXPECT_EQ(gateway.arrived().size(), 1U);
}

TEST(WriteTopics, DamagedRequestsAreDropped) {
  Gateway gateway;
  RawWriter stranger(kRequestTopic, "baudgate::v1::WriteRequest");
  WriteClient client;
  ASSERT_TRUE(Eventually([&] { return client.matched(); }));
  Bytes good(kMaxBytes<RequestSample>);
  good.resize(Encode(Request(9), good));
  ASSERT_TRUE(Eventually([&] {
    stranger.Write(good);
    return !gateway.arrived().empty();
  }));
  for (std::size_t size = 0; size < good.size(); ++size) {
    stranger.Write(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)));
  }
  for (const char* hex : {"FF FF FF FF", "00 03 00 00 01", "00 01 00 00 FF FF FF FF 00"}) {
    stranger.Write(*ParseHex(hex));
  }
  ASSERT_TRUE(client.Ask(Request(10)));
  ASSERT_TRUE(Eventually([&] { return gateway.arrived().back().request.seq == 10; }));
  for (const WriteArrival& arrival : gateway.arrived()) {
    EXPECT_TRUE(arrival.request.seq == 9 || arrival.request.seq == 10);
  }
}

// When a writer leaves, the DDS library delivers requests that it has held back because of too many
// client names.
TEST(WriteTopics, RequestsHeldBackByTheLibraryAreNeverExecuted) {
  Gateway gateway;
  WriteClient client;
  auto many = std::make_unique<WriteClient>();
  ASSERT_TRUE(Eventually([&] { return many->matched() && client.matched(); }));
  std::uint64_t names = 0;
  while (gateway.writer().dropped_requests() == 0) {
    ASSERT_LT(names, 8000U);
    for (int i = 0; i < 100; ++i, ++names) {
      many->Ask(Request(names, "substation-7", "made-up " + std::to_string(names)));
    }
    ASSERT_TRUE(Eventually([&] {
      return gateway.writer().dropped_requests() > 0 || gateway.arrived().size() == names;
    }));
  }
  const std::size_t before = gateway.arrived().size();
  EXPECT_GE(before, 1000U);
  many.reset();
  const std::uint64_t dropped = gateway.writer().dropped_requests();
  client.Ask(Request(1, "substation-7", "kept back"));
  EXPECT_TRUE(Eventually([&] { return gateway.writer().dropped_requests() > dropped; }));
  EXPECT_EQ(gateway.arrived().size(), before);
  gateway.writer().Write(PointSample());
  EXPECT_TRUE(Eventually([&] {
    client.Ask(Request(2, "substation-7", "late"));
    return gateway.arrived().back().request.client == "late";
  }));
  for (const WriteArrival& arrival : gateway.arrived()) {
    EXPECT_NE(arrival.request.client, "kept back");
  }
}

// The DDS library never frees the memory of a client name in a reply.
TEST(WriteTopics, RepliesToManyClientNamesStillArrive) {
  Gateway gateway;
  WriteClient client;
  ASSERT_TRUE(Eventually([&] { return client.matched(); }));
  ReplySample reply{"substation-7", "", 0, "ok", "", 0};
  for (; reply.seq < 3000; ++reply.seq) {
    reply.client = "made-up " + std::to_string(reply.seq);
    ASSERT_EQ(gateway.writer().Write(reply), Sent::yes) << reply.seq;
  }
  EXPECT_TRUE(Eventually([&] {
    gateway.writer().Write(reply);
    while (const auto heard = client.Take()) {
      if (*heard == reply) return true;
    }
    return false;
  }));
}

TEST(WriteTopics, ALateReaderGetsTheReply) {
  Gateway gateway;
  const ReplySample reply{"substation-7", "plc-1", 7, "ok", "", 42};
  ASSERT_EQ(gateway.writer().Write(reply), Sent::yes);
  WriteClient client;
  EXPECT_TRUE(Eventually([&] { return client.Take() == reply; }));
}

}  // namespace
}  // namespace baudgate::dds
