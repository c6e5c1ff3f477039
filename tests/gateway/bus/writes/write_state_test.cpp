// How a write may go on, and how it may end, from each of its states.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/bus/writes/write_command.h"

namespace baudgate {
namespace {

struct StateRow {
  WriteState state;
  const char* next;  ///< numbers of states
  const char* ends;
};

/// Nothing ends ok that was not sent, and nothing that was sent is said not to have been.
TEST(WriteStates, LeadOnAndEndAsTheTableSays) {
  const StateRow kRows[] = {
      {WriteState::asked, "134", "busy not_sent denied "},
      {WriteState::queued, "234", "refused busy not_sent denied "},
      {WriteState::sent, "1234", "ok refused busy unknown "},
      {WriteState::reading_back, "14", "ok differs not_sent "},
      {WriteState::ended, "", ""},
  };
  for (const StateRow& row : kRows) {
    std::string next;
    for (std::size_t to = 0; to < kWriteStates; ++to) {
      if (MayFollow(row.state, static_cast<WriteState>(to))) next += std::to_string(to);
    }
    std::string ends;
    for (std::size_t i = 0; i < kWriteEnds; ++i) {
      const auto end = static_cast<WriteEnd>(i);
      if (MayEnd(row.state, end)) ends.append(Name(end)).append(" ");
    }
    EXPECT_EQ(next, row.next) << row.ends;
    EXPECT_EQ(ends, row.ends);
  }
}

}  // namespace
}  // namespace baudgate
