// The registers of events of the whole program, read by pymodbus while the ring goes on under it:
// the file has more events than the ring, so that each that comes pushes one out.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/records/disk/events_file.h"
#include "gateway/records/events/event_file.h"
#include "tests/system/event_station.h"

namespace baudgate::system_test {
namespace {

using ::testing::Each;
using ::testing::SizeIs;

constexpr std::int64_t kBefore = 4100;  // events in the file at the start
constexpr std::int64_t kRing = 4000;

class EventRing : public EventStation {
 protected:
  /// Events of the relay and of a device that is no longer there, in turns of ten.
  void FillFile() const {
    const auto folder = directory() / "state" / gateway();
    std::filesystem::create_directories(folder);
    const auto opened = OpenEvents(folder / "events.db");
    ASSERT_TRUE(opened.database) << opened.error;
    events::EventTable table(*opened.database);
    std::vector<events::Batch> batches;
    for (std::int64_t seq = 1; seq <= kBefore; ++seq) {
      const bool own = seq / 10 % 2 == 0;
      events::EventRecord record;
      record.seq = seq;
      record.received = record.device_time = WallTime(std::chrono::seconds(1'700'000'000 + seq));
      record.line = "bay";
      record.device = own ? "bay-1" : "bay-9";
      record.code = static_cast<std::uint32_t>(100'000 + seq);
      batches.push_back({own ? 0U : 1U, "", false, {record}});
    }
    ASSERT_TRUE(table.Write(batches));
  }
  Json Read(int unit, std::int64_t first, std::int64_t last) const {
    const Finished reader = RunToEnd(
        {"/usr/bin/python3", std::string(SYSTEM_TEST_SOURCES) + "/pymodbus_events.py",
         std::to_string(port()), std::to_string(unit), std::to_string(first), std::to_string(last)},
        directory(), {}, 90s);
    EXPECT_EQ(reader.code, 0) << reader.errors;
    return Json::parse(reader.output, nullptr, false);
  }
};

TEST_F(EventRing, IsReadWholeWhileItGoesOn) {
  FillFile();
  const auto relay = StartRelay("every:100ms,count=6,numbered");
  const auto daemon = StartDaemon(Yaml());
  ASSERT_TRUE(Eventually([&] { return Status()["events"]["newest"] >= kBefore + 10; }))
      << daemon->Errors();
  const std::int64_t last = Status()["events"]["newest"].get<std::int64_t>() + 60;

  // The gateway's: all, from the oldest that there is. What is gone before it is read is counted.
  const Json all = Read(255, kBefore - kRing + 1, last);
  EXPECT_THAT(all["wrong"], SizeIs(0)) << all["wrong"];
  EXPECT_GE(all["oldest"].size(), 2U) << "the ring did not go on";
  const std::int64_t lost = all["lost"];
  EXPECT_GT(lost, 0);
  std::int64_t next = kBefore - kRing + 1 + lost;
  for (std::size_t i = 0; i < all["numbers"].size(); ++i, ++next) {
    ASSERT_EQ(all["numbers"][i], next);
    if (next <= kBefore) {
      ASSERT_EQ(all["codes"][i], 100'000 + next) << "half of another";
    }
  }
  EXPECT_GT(next, last);

  // The relay's own: others are skipped, and not counted.
  const Json own = Read(1, kBefore - 99, last);
  EXPECT_THAT(own["wrong"], SizeIs(0)) << own["wrong"];
  EXPECT_EQ(own["lost"], 0);
  std::int64_t before = 0;
  for (const std::int64_t number : own["numbers"]) {
    if (number <= kBefore) {
      EXPECT_EQ(number / 10 % 2, 0) << number;
      ++before;
    }
  }
  EXPECT_EQ(before, 50) << "of 4001 to 4100";
}

TEST_F(EventRing, ShowsTheNewestToWhoeverCanNotWrite) {
  const auto relay = StartRelay("every:200ms,count=3,numbered");
  const auto daemon = StartDaemon(Yaml());
  ModbusClient client(port());
  std::optional<std::uint16_t> count;
  ASSERT_TRUE(Eventually([&] {
    count = client.Register(1, 9024);
    return count == 7;
  })) << daemon->Errors();
  const auto block = client.Input(1, 9016, 80);
  ASSERT_TRUE(block.ok());
  for (std::size_t i = 0; i < 7; ++i) {
    const auto number = block.values[11 + 10 * i];
    EXPECT_EQ(number, block.values[3] - 6 + static_cast<int>(i)) << "the newest seven";
    EXPECT_GT(block.values[12 + 10 * i], 0) << "seconds since 1970, high word";
  }
  EXPECT_EQ(client.WriteRegister(1, 9016, 1), 0x03);
  EXPECT_EQ(client.WriteRegisters(1, 9018, {0, 1}), 0x02);
  EXPECT_EQ(client.WriteRegisters(1, 9016, {0, 2}), kNoException);
  EXPECT_EQ(client.Input(1, 9016, 80).values[11], 2);
}

}  // namespace
}  // namespace baudgate::system_test
