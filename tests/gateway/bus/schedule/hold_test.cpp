// What ends the hold of a line.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/schedule/turns.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

struct HoldRow {
  const char* what;
  void (*begin)(Hold&);
  void (*then)(Hold&);
  bool holds;
};

TEST(HoldTest, EndsAsTheTableSays) {
  const auto wind_up = [](Hold& hold) { hold.WindUp(); };
  const auto pause = [](Hold& hold) { hold.Pause(kStart); };
  const auto both = [](Hold& hold) {
    hold.Pause(kStart);
    hold.WindUp();
  };
  const auto go_on = [](Hold& hold) { EXPECT_TRUE(hold.GoOn()); };
  const auto close = [](Hold& hold) { hold.OnClosed(); };
  const auto call_off = [](Hold& hold) { hold.CallOffWindUp(); };
  const auto open = [](Hold& hold) { hold.OnOpened(); };
  const HoldRow kRows[] = {
      {"a pause goes on", pause, go_on, false},
      {"a pause, and the port closes", pause, close, false},
      {"a wind-up, and the port closes", wind_up, close, true},
      {"a wind-up, and the port opens again", wind_up, open, false},
      {"a wind-up that is called off", wind_up, call_off, false},
      {"a pause that goes on while the line winds up", both, go_on, true},
      {"both, and the port opens", both, open, false},
  };
  for (const HoldRow& row : kRows) {
    SCOPED_TRACE(row.what);
    Hold hold;
    row.begin(hold);
    EXPECT_TRUE(hold.holds());
    row.then(hold);
    EXPECT_EQ(hold.holds(), row.holds);
    EXPECT_FALSE(hold.GoOn()) << "there is no pause";
  }
}

}  // namespace
}  // namespace baudgate
