// The key records: of profiles, and what becomes of the points that stand there.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "config/history.h"
#include "config/loader.h"
#include "config/profile.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::Group;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kPoints =
    "device: D\npoints:\n"
    "- { name: phases, read: A1, type: uint16, group: slow }\n"
    "- { name: record1_a, read: A2, type: uint16, group: slow }\n"
    "- { name: record1_b, read: A3, type: uint16, group: fast }\n"
    "- { name: other, read: A4, type: uint16, group: slow }\n"
    "- { name: reset, write: A5, type: uint16, access: w }\n";

struct LoadedProfile {
  config::Profile profile;
  config::Device device;
  std::string problems;
};

/// As a device of the profile would have it. `keys`: behind the points.
LoadedProfile LoadKeys(const std::string& keys, bool events = true) {
  static const Protocol kProtocol = MakeFakeProtocol("fake");
  config::Problems problems;
  const auto raw = config::ReadProfileText(kPoints + keys, "p.yaml", "p", kProtocol, problems);
  LoadedProfile loaded{raw.profile, {}, {}};
  loaded.device.events = loaded.device.point_events = events;
  loaded.device.event_texts = raw.profile.event_texts;
  loaded.device.points = config::BuildPoints(raw.points, &kProtocol, problems);
  config::ResolveRecords(raw.profile.records, loaded.device, problems);
  loaded.problems = Shown(problems.Sorted());
  return loaded;
}

std::vector<Group> Groups(const LoadedProfile& loaded) {
  std::vector<Group> groups;
  for (const config::Point& point : loaded.device.points) groups.push_back(point.group);
  return groups;
}

constexpr const char* kTrip =
    "records: { trip: { points: [phases, 'record?_*'] } }\n"
    "events:\n- { code: 3, text: tripped, state: on, record: trip }\n- { code: 4, text: b }\n";

TEST(Records, AreTheirPointsAndAreReadDailyElse) {
  const LoadedProfile loaded = LoadKeys(kTrip);
  ASSERT_EQ(loaded.problems, "");
  ASSERT_EQ(loaded.device.records.size(), 1U);
  EXPECT_EQ(loaded.device.records[0].name, "trip");
  EXPECT_THAT(loaded.device.records[0].points, ElementsAre(0U, 1U, 2U));
  EXPECT_EQ(loaded.profile.event_texts.at(0).record, "trip");
  EXPECT_EQ(loaded.profile.event_texts.at(1).record, "");
  EXPECT_THAT(Groups(loaded),
              ElementsAre(Group::daily, Group::daily, Group::fast, Group::slow, Group::fast));
}

TEST(Records, StayWithTheirGroupsWhereNoEventIsKept) {
  EXPECT_THAT(Groups(LoadKeys(kTrip, false)),
              ElementsAre(Group::slow, Group::slow, Group::fast, Group::slow, Group::fast));
  const LoadedProfile unused = LoadKeys("records: { trip: { points: [phases] } }\n");
  EXPECT_EQ(unused.problems, "");
  EXPECT_EQ(Groups(unused).front(), Group::slow) << "no event has it";
}

TEST(Records, SayWhatIsWrong) {
  EXPECT_THAT(LoadKeys("records: { trip: { points: [phase] } }\n").problems,
              HasSubstr("p.yaml:8:18: error: records: 'phase' of 'trip' matches no point"));
  EXPECT_THAT(LoadKeys("records: { trip: { points: [reset] } }\n").problems,
              HasSubstr("matches no point that can be read"));
  EXPECT_THAT(LoadKeys("records: { trip: {} }\n").problems, HasSubstr("points"));
  EXPECT_THAT(LoadKeys("records: { trip: { points: [phases], group: once } }\n").problems,
              HasSubstr("group"));
  EXPECT_THAT(LoadKeys("records: { trip: { points: [phases] } }\n"
                       "events: [{ code: 1, text: a, record: tripp }]\n")
                  .problems,
              HasSubstr("record: 'records' of the profile has no 'tripp'; did you mean 'trip'?"));
  EXPECT_THAT(LoadKeys("events: [{ code: 1, text: a, record: trip }]\n").problems,
              HasSubstr("it has: none"));
}

}  // namespace
}  // namespace baudgate::testing
