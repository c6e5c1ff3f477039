// What an older baudgate took still loads, is warned of by its place, and is rewritten there and
// nowhere else.
// SPDX-License-Identifier: Apache-2.0
#include "config/renames.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "config/loader.h"
#include "gateway/cli/offline/migrate.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOld =
    "# Größe\n"
    "dds: { enabled: no }  # stays as it is\n"
    "lines:\n"
    "  - name: meters\n"
    "    port: /dev/ttyS0\n"
    "    protocol: set4tm\n"
    "    devices:\n"
    "      - name: incomer\n"
    "        address: 200\n"
    "        snapshot: yes   # ä: yes\n"
    "        profile: set-4tm.03m\n"
    "      - { name: feeder, address: 201, profile: set-4tm.03m, snapshot: \"off\", enabled: on "
    "}\n";
constexpr const char* kNew =
    "# Größe\n"
    "dds: { enabled: no }  # stays as it is\n"
    "lines:\n"
    "  - name: meters\n"
    "    port: /dev/ttyS0\n"
    "    protocol: set4tm\n"
    "    devices:\n"
    "      - name: incomer\n"
    "        address: 200\n"
    "        snapshot: true   # ä: yes\n"
    "        profile: set-4tm.03m\n"
    "      - { name: feeder, address: 201, profile: set-4tm.03m, snapshot: \"false\", enabled: on "
    "}\n";

std::vector<config::Renamed> Apply(const std::string& text, std::span<const config::Rename> table,
                                   config::FileKind kind = config::FileKind::configuration) {
  config::Problems problems;
  const auto root = config::ParseYaml("t.yaml", text, problems);
  EXPECT_EQ(Shown(problems.Sorted()), "");
  return root ? config::ApplyRenames(*root, kind, "fake", table) : std::vector<config::Renamed>();
}

std::string Rewritten(const std::string& text, std::span<const config::Rename> table,
                      config::FileKind kind = config::FileKind::configuration) {
  config::Problems problems;
  const std::string result = config::RewriteText(text, Apply(text, table, kind), problems);
  return problems.has_error() ? Shown(problems.Sorted()) : result;
}

TEST(Renames, AnOlderConfigurationLoadsAndIsWarnedOf) {
  const config::Loaded old = config::LoadText(kOld, "t.yaml", Shipped());
  EXPECT_TRUE(old.ok());
  EXPECT_EQ(
      Shown(old.problems),
      "t.yaml:10:19: warning: snapshot: 'yes' is 'true' since baudgate 0.1.0; it is taken so, "
      "and 'baudgate config migrate t.yaml' rewrites it\n"
      "t.yaml:12:71: warning: snapshot: 'off' is 'false' since baudgate 0.1.0; it is taken "
      "so, and 'baudgate config migrate t.yaml' rewrites it\n");
  ASSERT_TRUE(old.ok());
  EXPECT_EQ(old.config.lines[0].devices[0].options.Text("snapshot"), "true");
  EXPECT_EQ(old.config.lines[0].devices[1].options.Text("snapshot"), "false");
  EXPECT_EQ(Shown(config::LoadText(kNew, "t.yaml", Shipped()).problems), "");
}

/// Each row of the table loads with a warning, and what it is rewritten to without one.
TEST(Renames, EveryOneIsTakenByToday) {
  for (const config::Rename& one : config::Renames()) {
    EXPECT_FALSE(one.since.empty());
    ASSERT_EQ(one.path, "lines.devices") << "this test knows devices only";
    ASSERT_FALSE(one.value.empty());
    const std::string text =
        "lines: [{ name: l, port: /dev/l, protocol: " + std::string(one.protocol) +
        ", devices: [{ name: d, address: 1, " + std::string(one.key) + ": " +
        std::string(one.value) + " }] }]\n";
    const config::Loaded loaded = config::LoadText(text, "t.yaml", Shipped());
    EXPECT_TRUE(loaded.ok()) << Shown(loaded.problems);
    const auto now = config::LoadText(Rewritten(text, config::Renames()), "t.yaml", Shipped());
    EXPECT_TRUE(now.ok()) << Shown(now.problems);
    EXPECT_EQ(loaded.problems.size(), now.problems.size() + 1) << Shown(loaded.problems);
  }
}

TEST(Renames, AProfileOfOnesOwn) {
  const fs::path file = fs::path(::testing::TempDir()) / "renames-profile.yaml";
  std::ofstream(file) << "device: Own\nsnapshot: on\npoints:\n"
                         "  - { name: u, read: \"08 1B 00 11 float_le@0\", type: float32 }\n";
  config::Catalog catalog = Shipped();
  const auto loaded = config::LoadProfile(file.string(), *catalog.FindProtocol("set4tm"), catalog);
  EXPECT_EQ(Shown(loaded.problems),
            file.string() +
                ":2:11: warning: snapshot: 'on' is 'true' since baudgate 0.1.0; it is " +
                "taken so, and 'baudgate config migrate --protocol set4tm " + file.string() +
                "' rewrites it\n");
  std::ostringstream out;
  std::ostringstream err;
  EXPECT_EQ(RunMigrate({file.string(), false, ""}, catalog, out, err), 2);
  EXPECT_EQ(err.str(), "baudgate: " + file.string() +
                           " is a profile; say of which protocol, --protocol NAME\n");
  EXPECT_EQ(RunMigrate({file.string(), false, "set4tm"}, catalog, out, err), 0);
  EXPECT_NE(out.str().find("\nsnapshot: true\n"), std::string::npos);
  fs::remove(file);
}

TEST(Renames, KeysAndWordsOnlyWhereThePathLeads) {
  const config::Rename kTable[] = {
      {"lines", "", "wire", "", "port", "", "1.2"},
      {"lines.devices", "fake", "fast", "yes", "", "always", "1.2"},
      {"modbus.listen", "", "write", "never", "", "deny", "1.3"},
      {"", "", "bus", "", "lines", "", "1.4"},
  };
  EXPECT_EQ(Rewritten("wire: 1 # wire\nlines:\n- { wire: wire, protocol: fake, devices: [{ wire: 1,"
                      " fast: yes }, { protocol: other, fast: yes }] }\n",
                      kTable),
            "wire: 1 # wire\nlines:\n- { port: wire, protocol: fake, devices: [{ wire: 1,"
            " fast: always }, { protocol: other, fast: yes }] }\n");
  EXPECT_EQ(Rewritten("modbus: { listen: { write: never }, write: never }\n", kTable),
            "modbus: { listen: { write: deny }, write: never }\n");
  EXPECT_EQ(Rewritten("modbus: { listen: [a, { write: 'never' }] }\n", kTable),
            "modbus: { listen: [a, { write: 'deny' }] }\n");
  EXPECT_EQ(Rewritten("bus: []\n", kTable), "lines: []\n");
  EXPECT_EQ(Rewritten("bus: []\nlines: []\n", kTable), "bus: []\nlines: []\n")
      << "both: the reader says so";
  EXPECT_EQ(Rewritten("fast: yes\nwire: 1\npoints: []\n", kTable, config::FileKind::profile),
            "fast: always\nwire: 1\npoints: []\n");
  const auto found = Apply("lines:\n- wire: a\n", kTable);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].ToString(), "'wire' is 'port' since baudgate 1.2");
  EXPECT_EQ(found[0].mark.ToString(), "t.yaml:2:3");
}

TEST(Renames, WhatCanNotBeRewrittenWhereItStandsIsNamed) {
  const std::string text =
      "lines:\n- protocol: set4tm\n  devices: [{ snapshot: &a yes }, { snapshot: *a }]\n";
  EXPECT_EQ(Rewritten(text, config::Renames()),
            "t.yaml:3:25: error: snapshot: 'yes' is 'true' since baudgate 0.1.0; it can not be "
            "rewritten where it stands, change it by hand\n");
}

class Migrate : public ::testing::Test {
 protected:
  Migrate() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Migrate() override { fs::remove_all(folder_); }
  int Run(bool in_place) {
    out_.str("");
    err_.str("");
    return RunMigrate({file_.string(), in_place, ""}, Shipped(), out_, err_);
  }
  static std::string Read(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / "baudgate-migrate";
  const fs::path file_ = folder_ / "gate.yaml";
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(Migrate, PrintsTheNewTextAndSaysWhatIsAnother) {
  std::ofstream(file_) << kOld;
  EXPECT_EQ(Run(false), 0);
  EXPECT_EQ(out_.str(), kNew);
  EXPECT_EQ(Read(file_), kOld);
  EXPECT_EQ(err_.str(),
            file_.string() + ":10:19: snapshot: 'yes' is 'true' since baudgate 0.1.0\n" +
                file_.string() + ":12:71: snapshot: 'off' is 'false' since baudgate 0.1.0\n" +
                file_.string() + ": 2 places to rewrite; --in-place does so\n");
}

TEST_F(Migrate, InPlaceKeepsTheOldOneAndItsRights) {
  std::ofstream(file_) << kOld;
  ASSERT_EQ(::chmod(file_.c_str(), 0640), 0);
  const fs::path link = folder_ / "link.yaml";
  fs::create_symlink(file_, link);
  EXPECT_EQ(RunMigrate({link.string(), true, ""}, Shipped(), out_, err_), 0) << err_.str();
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(out_.str(), "");
  EXPECT_EQ(Read(file_), kNew);
  for (const char* tail : {"", ".bak"}) {
    EXPECT_EQ(fs::status(file_.string() + tail).permissions(), fs::perms(0640)) << tail;
  }
  EXPECT_EQ(Read(file_.string() + ".bak"), kOld);
  EXPECT_FALSE(fs::exists(file_.string() + ".part"));
  EXPECT_EQ(Run(true), 0) << "nothing is left to do";
  EXPECT_EQ(err_.str(), file_.string() + ": nothing to rewrite\n");
}

TEST_F(Migrate, NeverTakesTheCopyOfAnEarlierOne) {
  std::ofstream(file_) << kOld;
  std::ofstream(file_.string() + ".bak") << "kept";
  EXPECT_EQ(Run(true), 4);
  EXPECT_NE(err_.str().find("gate.yaml.bak is there already"), std::string::npos) << err_.str();
  EXPECT_EQ(Read(file_), kOld);
  EXPECT_EQ(Read(file_.string() + ".bak"), "kept");
}

TEST_F(Migrate, SaysWhatItCanNotReadOrRewrite) {
  EXPECT_EQ(Run(false), 4) << "there is none";
  std::ofstream(file_) << "lines: [\n";
  EXPECT_EQ(Run(true), 3);
  EXPECT_NE(err_.str().find("this is not YAML"), std::string::npos) << err_.str();
  std::ofstream(file_) << "lines: [{ protocol: set4tm, devices: [{ snapshot: !!str no }] }]\n";
  EXPECT_EQ(Run(true), 3);
  EXPECT_NE(err_.str().find("change it by hand"), std::string::npos) << err_.str();
  EXPECT_FALSE(fs::exists(file_.string() + ".bak"));
}

}  // namespace
}  // namespace baudgate::testing
