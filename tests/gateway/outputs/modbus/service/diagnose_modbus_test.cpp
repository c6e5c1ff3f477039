// What is said of serial masters and routes, and when nothing is.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/outputs/modbus/service/traffic_json.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr WallTime kToday = WallTime(1000h);

modbus::MasterStatus Open() {
  modbus::MasterStatus master;
  master.port = "/dev/ttyS1";
  master.is_open = true;
  master.text = "19200 8E1";
  master.since = kToday - 3h;
  master.frames = 1000;
  master.last_frame = kToday - 1s;
  return master;
}

TEST(DiagnoseMaster, OneThatIsHeardNeedsNoWord) {
  modbus::MasterStatus master = Open();
  EXPECT_THAT(DiagnoseMaster(master, kToday), IsEmpty());
  master.damaged = 9;
  EXPECT_THAT(DiagnoseMaster(master, kToday), IsEmpty()) << "now and then";
}

TEST(DiagnoseMaster, DamageIsSaidWithTheSettings) {
  modbus::MasterStatus master = Open();
  master.damaged = 250;
  EXPECT_THAT(
      DiagnoseMaster(master, kToday),
      ElementsAre("250 of 1250 frames were damaged and not answered: check bit rate, parity "
                  "and wiring (19200 8E1)"));
}

TEST(DiagnoseMaster, OneOfAnotherFramingIsTold) {
  modbus::MasterStatus master = Open();
  master.other = modbus::Framing::ascii;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre("the master is not understood: it speaks Modbus ASCII, and Modbus RTU is "
                          "spoken here; set framing: ascii at the listener, or change the other "
                          "side"));
}

TEST(DiagnoseMaster, AClosedPortSaysWhyAndSinceWhen) {
  modbus::MasterStatus master = Open();
  master.is_open = false;
  master.text = "No such file or directory";
  master.since = kToday - 5min;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre("port closed for 5 min: No such file or directory; it is tried again "
                          "until it works"));
}

TEST(DiagnoseMaster, AnEchoIsSaidWhateverElseIsHeard) {
  modbus::MasterStatus master = Open();
  master.echoes = 7;
  const char* kEcho = "the adapter has given back 7 of the gateway's own replies: set echo: strip";
  EXPECT_THAT(DiagnoseMaster(master, kToday), ElementsAre(kEcho));
  master.last_frame = kToday - 2min;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre(kEcho, "no request for 2 min: does the master still poll?"));
}

TEST(DiagnoseMaster, SilenceIsSaidByWhatWasHeardBefore) {
  modbus::MasterStatus master = Open();
  master.last_frame = kToday - 2min;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre("no request for 2 min: does the master still poll?"));
  master.last_frame = {};
  master.frames = 0;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre("not a byte was heard for 3 h: does the master poll, are A and B "
                          "swapped?"));
  master.damaged = 7;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre("bytes, but no whole request for 3 h: check bit rate, parity and wiring "
                          "(19200 8E1)"));
  master.since = kToday - 30s;
  master.damaged = 0;
  EXPECT_THAT(DiagnoseMaster(master, kToday), IsEmpty()) << "the port is open for a moment only";
}

TEST(DiagnoseRoute, OneThatAnswersNeedsNoWord) {
  modbus::RouteStatus route;
  route.requests = 12;
  route.ok = 10;
  route.refused = route.dropped = 1;
  EXPECT_THAT(DiagnoseRoute(route, kToday), IsEmpty());
}

TEST(DiagnoseRoute, FailuresAndLateRepliesAreSaid) {
  modbus::RouteStatus route;
  route.requests = 12;
  route.no_reply = route.expired = route.busy = 1;
  route.late = 2;
  route.last_trouble = "is gone";
  route.last_trouble_at = kToday - 30s;
  const std::string failed = "3 of 12 requests had no good reply, the last 30 s ago: is gone; ";
  const std::string late =
      "2 replies came after their deadline and were dropped: raise the route's deadline";
  EXPECT_THAT(DiagnoseRoute(route, kToday),
              ElementsAre(failed + "look at the power and the wire of its units", late));
  route.no_reply = 0;
  route.busy = 2;
  EXPECT_THAT(
      DiagnoseRoute(route, kToday),
      ElementsAre(failed + "clients ask faster than the line can: let them ask less", late));
  route.busy = 0;
  route.expired = 3;
  EXPECT_THAT(DiagnoseRoute(route, kToday),
              ElementsAre(failed + "the line has no time for it: let clients ask less, or raise "
                                   "the route's deadline",
                          late));
  route.last_trouble_at = kToday - 11min;
  EXPECT_THAT(DiagnoseRoute(route, kToday), ElementsAre(late)) << "it is over";
}

TEST(DiagnoseRoute, AUnitThatHasNeverAnsweredIsNamed) {
  modbus::RouteStatus route;
  route.target = "line drive";
  route.requests = route.by_unit[51].requests = 40;
  route.no_reply = route.by_unit[51].no_reply = 40;
  route.last_trouble = "no_reply";
  route.last_trouble_at = kToday - 1s;
  const std::string unit =
      "unit 51 has never answered its clients (40 requests: no_reply): check "
      "its power, its address and its wire; ";
  EXPECT_THAT(DiagnoseRoute(route, kToday),
              ElementsAre(unit + "check what they share as well: port, wiring, bit rate and parity "
                                 "of line drive"));
  route.by_unit[52].requests = route.by_unit[52].ok = 3;
  EXPECT_THAT(DiagnoseRoute(route, kToday),
              ElementsAre(unit + "line drive is right, unit 52 answers"));
}

}  // namespace
}  // namespace baudgate::control
