// What people are told of a participant that gets nothing.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/outputs/dds/fast/participant.h"

namespace baudgate::dds {
namespace {

TEST(Unanswered, TheCureFitsWhatIsNamedAlready) {
  const std::string both_sides =
      "it is on this machine and must use an address of dds.interfaces beside 127.0.0.1";
  const struct {
    std::string host;
    bool own;
    std::vector<std::string> interfaces;
    std::string cure;
  } rows[] = {
      {"10.0.0.9",
       false,
       {"127.0.0.1"},
       "name the address of this machine in its network in dds.interfaces"},
      {"10.0.0.5",
       true,
       {"10.0.0.5"},
       "it is on this machine, so name 127.0.0.1 in dds.interfaces as well"},
      {"10.0.0.5",
       true,
       {"127.0.0.1"},
       "it is on this machine, so name 10.0.0.5 in dds.interfaces as well"},
      {"10.0.0.5",
       true,
       {"10.1.0.5"},
       "it is on this machine, so name 127.0.0.1 and 10.0.0.5 in dds.interfaces as well"},
      {"127.0.0.1",
       true,
       {"10.0.0.5"},
       "it is on this machine, so name 127.0.0.1 in dds.interfaces as well"},
      {"127.0.0.1", true, {"127.0.0.1", "10.0.0.5"}, both_sides},
      {"10.0.0.5", true, {"127.0.0.1", "10.0.0.5"}, both_sides},
      {"127.0.0.1", true, {}, both_sides},
      {"127.0.0.1", true, {"0.0.0.0"}, both_sides},
  };
  for (const auto& row : rows) {
    EXPECT_EQ(UnansweredRemark(row.host, row.own, row.interfaces),
              row.host + " was heard and cannot be answered: " + row.cure);
  }
}

}  // namespace
}  // namespace baudgate::dds
