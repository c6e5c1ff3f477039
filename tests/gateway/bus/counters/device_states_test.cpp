// The state of a device that is shown and told: out of use from the start, troubles and remarks.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/bus/counters/accounts.h"
#include "tests/gateway/bus/poller/part_fixture.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A device that says what the test says.
class Saying final : public Conversation {
 public:
  std::span<const Query> Queries() const override { return {}; }
  Result<Request> Ask(const Task&, Instant) override { return Error{"nothing to ask"}; }
  Answer OnFrame(const Task&, const Request&, View, Instant) override { return {}; }
  Outcome Check(View, View) const override { return Outcome::ok; }
  Answer Interpret(View, View) override { return {}; }
  const DeviceTrouble& trouble() const override { return says; }

  DeviceTrouble says;
};

class DeviceStatesTest : public ::testing::Test, protected PollerListener {
 protected:
  void Make() {
    PollerListener& listener = *this;
    states_.emplace(members_.roster, store_, listener);
  }
  DeviceStatus Status() const {
    DeviceStatus status;
    store_.Read(0, [&](const DeviceRecord& record) { status = record.status; });
    return status;
  }
  std::vector<std::string> Told() { return std::exchange(told_, {}); }
  std::vector<std::string> Warned() { return std::exchange(warned_, {}); }

  ToyMembers members_;
  config::Config config_ = ToyConfig();
  PointStore store_{config_};
  std::optional<DeviceStates> states_;

 private:
  void OnDeviceState(std::uint32_t, DeviceState from, DeviceState to, const std::string& reason,
                     Now) override {
    told_.push_back(std::string(Name(from)) + " -> " + std::string(Name(to)) + ": " + reason);
  }
  void OnNews(News news, Now) override { told_.push_back((news.over ? "over: " : "") + news.text); }
  void OnWarning(std::uint32_t, const std::string& message) override { warned_.push_back(message); }

  std::vector<std::string> told_;
  std::vector<std::string> warned_;
};

TEST_F(DeviceStatesTest, ADeviceThatTheConfigurationDoesNotUseIsTakenIntoUse) {
  members_.a.in_use = false;
  Make();
  store_.UpdateStatus(0, [](DeviceStatus& status) { status.state = DeviceState::disabled; });
  states_->OnState(members_.a, "taken out of use");
  EXPECT_THAT(Told(), IsEmpty()) << "it was";
  members_.a.in_use = true;
  states_->OnState(members_.a, "taken into use");
  EXPECT_THAT(Told(), ElementsAre("disabled -> never seen: taken into use"));
  EXPECT_EQ(Status().state, DeviceState::never_seen);
}

/// A remark is shown, and said once in the log. Values are good meanwhile, so it is no event.
TEST_F(DeviceStatesTest, ARemarkIsNoTrouble) {
  const std::string wrong = "type 0D, the profile says 08";
  const std::string remark = "gives no events";
  struct Row {
    DeviceTrouble says;
    std::vector<std::string> told;
    std::vector<std::string> warned;
  };
  const Row rows[] = {
      {{Reason::none, remark}, {}, {remark}},
      {{Reason::none, ""}, {}, {"no longer so: " + remark}},
      {{Reason::other_module, wrong}, {wrong}, {wrong}},
      {{Reason::other_module, wrong}, {}, {}},
      {{Reason::none, remark}, {"over: "}, {"it is the configured device again; " + remark}},
      {{Reason::other_module, wrong}, {wrong}, {wrong}},
      {{Reason::other_module, "type 0E"}, {"type 0E"}, {"type 0E"}},
      {{Reason::none, ""}, {"over: "}, {"it is the configured device again"}},
      {{Reason::none, wrong}, {}, {wrong}},
      {{Reason::other_module, wrong}, {wrong}, {wrong}},  // the same words, and serious now
      {{Reason::none, wrong}, {"over: "}, {"it is the configured device again; " + wrong}},
  };
  auto conversation = std::make_unique<Saying>();
  Saying& device = *conversation;
  members_.a.conversation = std::move(conversation);
  Make();
  for (const Row& row : rows) {
    device.says = row.says;
    states_->OnTrouble(members_.a);
    EXPECT_EQ(Told(), row.told) << row.says.text;
    EXPECT_EQ(Warned(), row.warned) << row.says.text;
    EXPECT_EQ(Status().trouble, row.says.text);
  }
}

}  // namespace
}  // namespace baudgate
