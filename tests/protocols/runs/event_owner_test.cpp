// Whose events are these? A batch behind a lost request waits until the relay has told its name:
// another one may stand there now. If the name does not come the batch is not lost either.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

class EventOwner : public ::testing::Test {
 protected:
  EventOwner() {
    rig_->Open();
    EXPECT_TRUE(rig_->RunUntil([this] { return rig_.AllGood(); }, 2min));
    rig_->RunFor(10s);
    rig_->twin(0).manner.instead = [this](View request) { return Instead(request); };
  }

  static bool Asks(View request, char category) {
    return request.size() > 3 && request[2] == 'R' && request[3] == category;
  }
  static Bytes Said(std::string_view data) {
    Bytes frame = ToBytes("<1D:" + std::string(data) + ":");
    Append(frame, HexByte(Xor8(frame)) + "\r\n");
    return frame;
  }

  std::optional<Bytes> Instead(View request) {
    if (Asks(request, 'L') && loses_) {
      loses_ = false;
      lost_ = true;
      return Bytes();
    }
    if (lost_ && Asks(request, 'B')) ++backups_;
    if (lost_ && Asks(request, 'F') && name_) return name_->empty() ? Bytes() : Said(*name_);
    return std::nullopt;
  }

  /// The relay takes it out of its register with L, and the reply does not arrive.
  void Raise(std::uint32_t code) {
    ASSERT_TRUE(rig_->twin(0).twin->Raise({1, code, {}, {}}, rig_->now()));
    loses_ = true;
  }

  Rig rig_{RealLine("Spa9600"), [](config::Line& line) {
             for (config::Device& device : line.devices) {
               device.events = true;
               device.identity.others = {{"SPAU130C", "spau130c"}};
             }
           }};
  bool loses_ = false;
  bool lost_ = false;
  int backups_ = 0;
  std::optional<std::string> name_;  ///< in place of its own; empty: silence
};

TEST_F(EventOwner, TheRelayItself) {
  Raise(7);
  rig_->RunFor(5s);
  EXPECT_TRUE(lost_);
  EXPECT_GE(backups_, 1);
  ASSERT_EQ(rig_->events.size(), 1U);
  EXPECT_EQ(rig_->events[0].batch.events[0].code, 7U);
}

TEST_F(EventOwner, AnotherRelayWhoseEventsAreNotItsOwn) {
  name_ = "SPAU 130 C";
  Raise(7);
  rig_->RunFor(1min);
  EXPECT_GE(backups_, 1);
  EXPECT_TRUE(rig_->events.empty()) << "filed under the name of the one before";
  EXPECT_FALSE(rig_.AnyUsable(0));

  name_.reset();
  rig_->RunFor(3min);
  ASSERT_EQ(rig_->events.size(), 1U) << "the right one is back, and has kept its own";
  EXPECT_EQ(rig_->events[0].batch.events[0].code, 7U);
}

TEST_F(EventOwner, NobodyWhoTellsAName) {
  name_ = "";
  Raise(7);
  rig_->RunFor(20s);
  EXPECT_GE(backups_, 1);
  EXPECT_TRUE(rig_->events.empty());

  name_.reset();
  rig_->RunFor(3min);
  ASSERT_EQ(rig_->events.size(), 1U) << "neither lost nor doubled";
  EXPECT_EQ(rig_->events[0].batch.events[0].code, 7U);
}

}  // namespace
}  // namespace baudgate
