// Compares every row of every shipped profile with the table of its device
// (tests/protocols/tables/table.h).
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "config/loader.h"
#include "tests/config/shipped.h"
#include "tests/protocols/tables/table.h"

namespace baudgate::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pointwise;

constexpr char kFolder[] = "tests/protocols/tables";

std::string TextOf(const std::string& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string NameOf(const config::ProfileFile& file) { return file.protocol + "/" + file.name; }

config::Profile LoadShipped(const config::ProfileFile& file) {
  const protocols::Protocol& protocol = *Shipped().FindProtocol(file.protocol);
  return config::LoadProfile(file.path.string(), protocol, Shipped()).profile;
}

Table TableOf(const std::string& name) {
  const std::string path = std::string(kFolder) + "/" + name + ".table";
  std::vector<std::string> problems;
  Table table = ReadTable(TextOf(path), path, problems);
  EXPECT_THAT(problems, IsEmpty());
  return table;
}

MATCHER(StartsWithIt, "") { return std::get<0>(arg).starts_with(std::get<1>(arg)); }

class ShippedProfile : public ::testing::TestWithParam<config::ProfileFile> {};

TEST_P(ShippedProfile, MatchesItsTable) {
  const Table table = TableOf(NameOf(GetParam()));
  ASSERT_FALSE(table.rows.empty()) << "no table for " << NameOf(GetParam());
  EXPECT_THAT(Differences(LoadShipped(GetParam()), table), IsEmpty());
}

TEST_P(ShippedProfile, EveryChangedFieldIsFound) {
  const Table table = TableOf(NameOf(GetParam()));
  const config::Profile profile = LoadShipped(GetParam());
  const std::map<std::string, void (*)(config::Point&)> turns = {
      {"read", [](config::Point& p) { p.read += "1"; }},
      {"write", [](config::Point& p) { p.write += "1"; }},
      {"type",
       [](config::Point& p) {
         p.type = p.type == config::Type::int32 ? config::Type::uint32 : config::Type::int32;
       }},
      {"unit", [](config::Point& p) { p.unit += "k"; }},
      {"scale", [](config::Point& p) { p.scale *= 10; }},
      {"offset", [](config::Point& p) { p.offset = p.offset + 1; }},
      {"sentinels",
       [](config::Point& p) {
         p.sentinels.push_back({-1, Quality::bad_sensor_failure});
       }},
      {"access",
       [](config::Point& p) {
         const bool both = p.access == config::Access::read_write;
         p.access = both ? config::Access::read : config::Access::read_write;
       }},
  };
  for (const auto& [field, turn] : turns) {
    config::Profile turned = profile;
    std::vector<std::string> beginnings;
    for (config::Point& point : turned.points) {
      turn(point);
      beginnings.push_back(NameOf(GetParam()) + ": point " + point.name + ": " + field + " is ");
    }
    EXPECT_THAT(Differences(turned, table), Pointwise(StartsWithIt(), beginnings));
  }
}

std::vector<config::ProfileFile> ShippedProfiles() { return Shipped().Profiles(); }

INSTANTIATE_TEST_SUITE_P(All, ShippedProfile, ::testing::ValuesIn(ShippedProfiles()),
                         [](const ::testing::TestParamInfo<config::ProfileFile>& info) {
                           std::string name = NameOf(info.param);
                           for (char& c : name) c = std::isalnum(c) != 0 ? c : '_';
                           return name;
                         });

TEST(Tables, EveryTableHasAProfile) {
  std::set<std::string> profiles;
  for (const config::ProfileFile& file : ShippedProfiles()) profiles.insert(NameOf(file));
  std::set<std::string> tables;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kFolder)) {
    if (entry.path().extension() != ".table") continue;
    tables.insert(entry.path().parent_path().filename().string() + "/" +
                  entry.path().stem().string());
  }
  EXPECT_EQ(tables, profiles);
}

TEST(Tables, UncertainRowsAreCounted) {
  struct Doubt {
    int inferred;
    int unsourced;
    bool operator==(const Doubt&) const = default;
  };
  const std::map<std::string, Doubt> kDoubts = {
      {"dcon/adam-4017plus", {.inferred = 9, .unsourced = 0}},
      {"dcon/adam-4018plus", {.inferred = 9, .unsourced = 0}},
      {"dcon/icpdas-i-7017", {.inferred = 9, .unsourced = 0}},
      {"dcon/icpdas-i-7024", {.inferred = 13, .unsourced = 0}},
      {"dcon/icpdas-i-7060", {.inferred = 9, .unsourced = 0}},
      {"dcon/icpdas-i-7080", {.inferred = 2, .unsourced = 0}},
      {"dcon/owen-mv110-2a", {.inferred = 2, .unsourced = 0}},
      {"dcon/owen-mv110-8a", {.inferred = 1, .unsourced = 0}},
      {"modbus_rtu/generic-meter", {.inferred = 0, .unsourced = 36}},
      {"modbus_rtu/mitsubishi-fr-d700", {.inferred = 1, .unsourced = 18}},
      {"reader/bar-code", {.inferred = 0, .unsourced = 0}},
      {"reader/olimex-mod-rfid125", {.inferred = 0, .unsourced = 0}},
      {"reader/olimex-mod-rfid125-asked", {.inferred = 3, .unsourced = 0}},
      {"reader/weighing", {.inferred = 0, .unsourced = 0}},
      {"set4tm/set-4tm.02", {.inferred = 0, .unsourced = 0}},
      {"set4tm/set-4tm.03m", {.inferred = 152, .unsourced = 0}},
      {"spabus/spaj140c", {.inferred = 70, .unsourced = 6}},
      {"spabus/spau130c", {.inferred = 16, .unsourced = 0}},
      {"telegram/lauda-thermostat", {.inferred = 0, .unsourced = 0}},
      {"telegram/mt-sics", {.inferred = 4, .unsourced = 0}},
      {"telegram/nmea-0183-weather", {.inferred = 1, .unsourced = 0}},
      {"telegram/owen-mv110-8a-telegrams", {.inferred = 0, .unsourced = 0}},
      {"telegram/scpi-instrument", {.inferred = 1, .unsourced = 0}},
  };
  for (const config::ProfileFile& file : ShippedProfiles()) {
    const std::string name = NameOf(file);
    const Table table = TableOf(name);
    ASSERT_TRUE(kDoubts.contains(name)) << name;
    EXPECT_EQ(table.Count(Standing::inferred), kDoubts.at(name).inferred) << name;
    EXPECT_EQ(table.Count(Standing::unsourced), kDoubts.at(name).unsourced) << name;
  }
}

constexpr char kRow[] = "p | I1 | - | float32 | A | 1 | 0 | - | r | certain | 1\n";

config::Profile SmallProfile() {
  config::Profile profile;
  profile.protocol = "toy";
  profile.name = "small";
  config::Point point;
  point.name = "p";
  point.read = "I1";
  point.unit = "A";
  profile.points.push_back(point);
  return profile;
}

std::vector<std::string> DifferencesTo(const std::string& table,
                                       const config::Profile& profile = SmallProfile()) {
  std::vector<std::string> problems;
  const Table read = ReadTable(table, "small.table", problems);
  EXPECT_THAT(problems, IsEmpty());
  return Differences(profile, read);
}

TEST(Tables, AMissingAndAnExtraPointAreNamed) {
  EXPECT_THAT(DifferencesTo(kRow), IsEmpty());
  EXPECT_THAT(DifferencesTo(""), ElementsAre("toy/small: point p: not in the table"));
  EXPECT_THAT(
      DifferencesTo(std::string(kRow) + "q | I2 | - | bool | - | 1 | 0 | - | r | certain | 1\n"),
      ElementsAre("toy/small: point q: in the table, but not in the profile"));
}

TEST(Tables, AChangedFieldIsDescribed) {
  config::Profile profile = SmallProfile();
  profile.points[0].unit.clear();
  profile.points[0].access = config::Access::read_write;
  EXPECT_THAT(DifferencesTo(kRow, profile),
              ElementsAre("toy/small: point p: unit is nothing, the table says 'A'",
                          "toy/small: point p: access is 'rw', the table says 'r'"));
}

TEST(Tables, ATextMayBeLongerThanInTheTable) {
  config::Profile profile = SmallProfile();
  profile.points[0].type = config::Type::string;
  profile.points[0].text_length = 8;
  const auto with = [&](const std::string& type) {
    return DifferencesTo("p | I1 | - | " + type + " | A | 1 | 0 | - | r | certain | 1\n", profile);
  };
  EXPECT_THAT(with("string"), IsEmpty());
  EXPECT_THAT(with("string(8)"), IsEmpty());
  EXPECT_THAT(with("string(9)"),
              ElementsAre("toy/small: point p: type is 'string(8)', the table says 'string(9)'"));
  EXPECT_EQ(with("float32").size(), 1U);
}

TEST(Tables, OptionsAreCompared) {
  config::Profile profile = SmallProfile();
  profile.options.Set("over", std::vector<std::string>{"fault 1=E.OC1 overcurrent", "+99"});
  const std::string row = kRow;
  EXPECT_THAT(DifferencesTo(row + "option | over | fault 1=E.OC1, +99 | certain | 1\n", profile),
              IsEmpty());
  EXPECT_THAT(
      DifferencesTo(row + "option | over | fault 1=E.OC, +99 | certain | 1\n", profile),
      ElementsAre(HasSubstr("toy/small: option over: is 'fault 1=E.OC1 overcurrent, +99'")));
  EXPECT_EQ(DifferencesTo(row + "option | over | fault 1=E.OC1 | certain | 1\n", profile).size(),
            1U);
  EXPECT_THAT(DifferencesTo(row, profile), ElementsAre("toy/small: option over: not in the table"));
  EXPECT_THAT(DifferencesTo(row + "option | over | +99 | certain | 1\n"),
              ElementsAre("toy/small: option over: in the table, but not in the profile"));
}

TEST(Tables, ErrorsOfATableAreReportedWithTheirLine) {
  const auto problems = [](const std::string& text) {
    std::vector<std::string> found;
    ReadTable(text, "small.table", found);
    return found;
  };
  EXPECT_THAT(problems("# comment\np | I1\n"), ElementsAre("small.table:2: a point has 11 cells"));
  EXPECT_THAT(problems(std::string(kRow) + kRow),
              ElementsAre("small.table:2: point p stands twice"));
  EXPECT_THAT(problems("option | over\n"), ElementsAre("small.table:1: an option has 5 cells"));
  EXPECT_THAT(problems("p | I1 | - | bool | - | 1 | 0 | - | r | sure | 1\n"),
              ElementsAre("small.table:1: 'sure' is no standing: certain, inferred or unsourced"));
  EXPECT_THAT(
      problems("p | I1 | - | bool | - | one | 0 | - | r | certain | -\n"),
      ElementsAre("small.table:1: point p names no source", "small.table:1: 'one' is no number"));
}

}  // namespace
}  // namespace baudgate::testing
