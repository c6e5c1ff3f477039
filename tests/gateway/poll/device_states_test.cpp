// The state of a device that is shown and told: out of use from the start.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/device_states.h"

#include <gmock/gmock.h>

#include "tests/gateway/poll/part_fixture.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

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

}  // namespace
}  // namespace baudgate
