// What becomes of a write that its line cannot take, and how it is counted.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/lines/lines.h"
#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

class LineDispatcherTest : public ::testing::Test {
 protected:
  LineDispatcherTest() {
    catalog_.protocols["toy"] = &ToyProtocol();
    config::Line line = ToyLine({ToyDevice("a", "A", {"1"})});
    line.protocol = "toy";
    line.port = "tcp://127.0.0.1:1";
    config_.lines = {line};
    store_ = std::make_unique<PointStore>(config_);
    lines_ = std::make_unique<Lines>(*store_, catalog_, 1);
    lines_->Add({std::shared_ptr<void>(), config_.lines.data()});
    dispatcher_ = std::make_unique<LineDispatcher>(*store_, catalog_, *lines_);
  }

  /// False: busy.
  bool Write(std::uint32_t device = 0) {
    WriteCommand command;
    command.device = device;
    command.client = "user:anna";
    command.kind = Writes{{0, 1.0}};
    command.done = [this](const WriteResult& result) { result_ = result; };
    return dispatcher_->Submit(std::move(command));
  }
  std::uint64_t Counted(WriteEnd end, std::uint32_t device = 0) const {
    std::uint64_t count = 0;
    store_->Read(device, [&](const DeviceRecord& record) {
      count = record.status.writes.ends[static_cast<std::size_t>(end)];
    });
    return count;
  }

  config::Catalog catalog_;
  config::Config config_;
  std::unique_ptr<PointStore> store_;
  std::unique_ptr<Lines> lines_;
  std::unique_ptr<LineDispatcher> dispatcher_;
  std::optional<WriteResult> result_;
};

TEST_F(LineDispatcherTest, ALineThatHangsIsNotBusy) {
  lines_->at(0).With([](LineRunner& runner) { runner.SetStuck(ReadClocks().wall); });
  EXPECT_TRUE(Write());
  ASSERT_TRUE(result_);
  EXPECT_EQ(result_->end, WriteEnd::not_sent);
  EXPECT_EQ(result_->reason, "the driver of its line does not answer");
  EXPECT_EQ(Counted(WriteEnd::not_sent), 1U);
}

TEST_F(LineDispatcherTest, NorIsOneThatAReloadHasEnded) {
  const auto ended = lines_->at(0).Take();
  EXPECT_TRUE(Write());
  ASSERT_TRUE(result_);
  EXPECT_EQ(result_->end, WriteEnd::not_sent);
  EXPECT_EQ(Counted(WriteEnd::not_sent), 1U);
}

/// A reload waits for the end of a line before it tells the routes.
TEST_F(LineDispatcherTest, NorIsItForARoutedRequest) {
  const auto ended = lines_->at(0).Take();
  std::optional<RoutedReply> reply;
  RoutedRequest request;
  request.pdu = {3, 0, 0, 0, 1};
  request.done = [&](RoutedReply said) { reply = std::move(said); };
  EXPECT_TRUE(lines_->at(0).Submit(std::move(request)));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->outcome, Outcome::line_down);
  EXPECT_EQ(reply->reason, LineSlot::kNotThere);
  EXPECT_FALSE(reply->sent);
}

/// A reload puts a line into the store before it runs; DDS learns of it there.
TEST_F(LineDispatcherTest, NorIsOneThatAReloadIsAdding) {
  config::Line added = config_.lines[0];
  added.name = "added";
  store_->Append(added);
  EXPECT_TRUE(Write(1));
  ASSERT_TRUE(result_);
  EXPECT_EQ(result_->end, WriteEnd::not_sent);
  dispatcher_->SetInUse(1, true);
  dispatcher_->Release(1, 1s);
  EXPECT_EQ(Counted(WriteEnd::not_sent, 1), 1U);
}

TEST_F(LineDispatcherTest, AFullQueueIsBusyAndCounted) {
  int taken = 0;
  while (taken < 1000 && Write()) ++taken;
  EXPECT_EQ(taken, 16) << "half of the room for one client";
  EXPECT_EQ(Counted(WriteEnd::busy), 1U);
  EXPECT_FALSE(result_);
}

TEST_F(LineDispatcherTest, WhatTheGatewayRefusesIsCountedAsWhatItIs) {
  dispatcher_->OnNotTaken({.client = "user:anna", .point = 0});
  dispatcher_->OnNotTaken({.client = "user:anna", .point = 0, .end = WriteEnd::busy});
  dispatcher_->OnNotTaken({.client = "user:anna", .point = 1, .counts = false});
  EXPECT_EQ(Counted(WriteEnd::denied), 1U) << "a command of two points is one write";
  EXPECT_EQ(Counted(WriteEnd::busy), 1U);
}

TEST_F(LineDispatcherTest, ATelegramByHandIsNoWriteToAPoint) {
  dispatcher_->OnNotTaken({.client = "user:anna", .value = std::string("3E **")});
  EXPECT_EQ(Counted(WriteEnd::denied), 0U);
}

}  // namespace
}  // namespace baudgate
