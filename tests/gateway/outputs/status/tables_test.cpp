// Tests of the tables of counters of lines and devices: each row makes a field of the JSON and a
// part of the text.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/outputs/status/value_json.h"
#include "tests/gateway/outputs/status/table_docs.h"
#include "tests/gateway/outputs/status/two_lines.h"

namespace baudgate::status {

struct Toy {
  std::uint64_t resets = 7;
  std::uint32_t hidden = 1;
  Duration busy = 1500ms;
  Duration wait = 1500us;
  std::optional<Duration> bound;
  std::optional<Instant> last = kNow.instant - 2s;
  WallTime seen = kNow.wall - 3s;
  bus::DeviceState state = bus::DeviceState::offline;
  std::uint64_t Twice() const { return 2 * resets; }
};

template <typename Visit>
void VisitFields(const Toy*, Visit visit) {
  visit(bus::Counted<&Toy::resets>{.label = "resets"});
  visit(bus::NotInJson<&Toy::hidden>());
  visit(bus::Counted<&Toy::busy>{.key = "busy_ms"});
  visit(bus::Counted<&Toy::wait>{.key = "wait_us", .label = "wait", .place = -1});
  visit(bus::Counted<&Toy::bound>{.key = "bound_ms"});
  visit(bus::Counted<&Toy::last>{.key = "age_ms"});
  visit(bus::Counted<&Toy::seen>());
  visit(bus::Counted<&Toy::seen>{.key = "seen_ms"});
  visit(bus::Counted<&Toy::state>());
  visit(bus::Counted<&Toy::Twice>{.key = "twice"});
}

namespace {

using Json = nlohmann::ordered_json;
using ::testing::IsEmpty;

TEST(Tables, TheJsonIsBuiltFromTheRows) {
  Json json;
  AddFields(Toy(), kNow, json);
  EXPECT_EQ(json.dump(),
            R"({"resets":7,"busy_ms":1500,"wait_us":1500,"bound_ms":null,"age_ms":2000,)"
            R"("seen":"2026-09-21T14:13:17.000Z","seen_ms":3000,"state":"offline","twice":14})");
  EXPECT_EQ(LabelsJson<Toy>().dump(), R"({"wait_us":"wait","resets":"resets"})");
}

TEST(Tables, EachKeyIsUniqueAndDocumented) {
  EXPECT_THAT(TroublesOfKeys<bus::LineStatus>("field of a line"), IsEmpty());
  EXPECT_THAT(TroublesOfKeys<bus::DeviceStatus>("field of a device"), IsEmpty());
  EXPECT_THAT(TroublesOfKeys<bus::MinuteCounts>("field of a device"), IsEmpty());
}

/// Users rely on the order of the keys, so the order is tested.
TEST(Tables, TheJsonOfADeviceIsUnchanged) {
  Json json;
  AddFields(bus::DeviceStatus(), kNow, json);
  const Json none = nullptr;
  const Json outcomes = Json::parse(R"({"ok":0,"no_reply":0,"partial":0,"corrupt":0,
    "unexpected":0,"busy":0,"refused":0,"unsupported":0,"line_down":0})");
  Json recent = {{"exchanges", 0}};
  recent.update(outcomes);
  const Json expected = {
      {"state", "never seen"},
      {"last_outcome", "none"},
      {"last_reason", ""},
      {"trouble", ""},
      {"last_ok", none},
      {"age_ms", none},
      {"exchanges", 0},
      {"outcomes", outcomes},
      {"retries", 0},
      {"missed", 0},
      {"late", 0},
      {"lateness_ms", 0},
      {"patience_ms", 0},
      {"doubled", 0},
      {"rechecks", 0},
      {"unconfirmed", 0},
      {"unasked", false},
      {"lost_events", 0},
      {"writes", Json::parse(R"({"ok":0,"differs":0,"refused":0,"busy":0,"unknown":0,"not_sent":0,
         "denied":0,"not_read_back":0})")},
      {"learned", ""},
      {"times", Json::array()},
      {"recent", recent},
      {"seen", Json::object()},
      {"hour", Json::parse(R"({"answered":0,"failed":0,"repeats":0,"missed":0,"outages":0,
         "availability":1.0})")},
      {"busy_ms", 0},
      {"round_trips", Json::parse(R"({"count":0,"last_us":0,"mean_us":0,"p50_us":0,"p99_us":0,
         "histogram":[]})")}};
  json["hour"].erase("minutes");
  EXPECT_EQ(Known(json, expected).dump(), expected.dump());
}

TEST(Tables, TheJsonOfALineIsUnchanged) {
  bus::LineStatus line;
  line.collisions = 2;
  line.echoes = 1;
  line.busy = 68min;
  Json json;
  AddFields(line, kNow, json);
  const Json expected =
      Json::parse(R"({"times_lost":0,"echo_lost_since":null,"use":0.0,"minute":{"polls":0.0,)"
                  R"("probes":0.0,"routes":0.0,"writes":0.0,"silence":0.0,"drains":0.0},)"
                  R"("exchanges":0,"bytes_in":0,"bytes_out":0,"stray_bytes":0,"late":0,)"
                  R"("collisions":2,"echoes":1,"probes":0,"busy_ms":4080000,"parity_errors":0,)"
                  R"("framing_errors":0,"overruns":0,"notice_bound_ms":null})");
  EXPECT_EQ(Known(json, expected).dump(), expected.dump());
}

}  // namespace
}  // namespace baudgate::status
