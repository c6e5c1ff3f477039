// The tree against docs/modules.txt; and that a wrong include would be found.
// SPDX-License-Identifier: Apache-2.0
#include "tests/layers/modules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace baudgate::layers {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

namespace fs = std::filesystem;

std::string ReadFile(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// All sources of the product, as paths from the root.
std::vector<std::string> Sources() {
  std::vector<std::string> sources;
  for (const char* top : {"config", "protocols", "transports", "gateway"}) {
    for (const auto& entry : fs::recursive_directory_iterator(top)) {
      const std::string extension = entry.path().extension();
      if (extension == ".h" || extension == ".cpp") sources.push_back(entry.path().string());
    }
  }
  std::ranges::sort(sources);
  return sources;
}

std::vector<Entry> TheTable() { return ReadTable(ReadFile("docs/modules.txt")); }

TEST(Layers, NoSourceIncludesWhatItsModuleMayNotInclude) {
  const std::vector<Entry> table = TheTable();
  const std::vector<std::string> sources = Sources();
  for (const std::string& path : sources) {
    EXPECT_THAT(WrongIncludes(table, path, ReadFile(path)), IsEmpty());
  }
  EXPECT_GT(sources.size(), 300U);
}

TEST(Layers, EachNamesOnlyWhatStandsAboveIt) { EXPECT_THAT(WrongNames(TheTable()), IsEmpty()); }

TEST(Layers, EveryNameInTheTableIsUsed) {
  const std::vector<Entry> table = TheTable();
  std::map<std::string, std::set<std::string>> used;
  for (const std::string& path : Sources()) WrongIncludes(table, path, ReadFile(path), &used);
  for (const Entry& entry : table) {
    for (const std::string& name : entry.may) {
      EXPECT_TRUE(used[entry.layer + "|" + entry.name].contains(name))
          << entry.name << " may include " << name
          << " and never does: take it out of docs/modules.txt";
    }
  }
}

/// A protocol is loaded at run time: only its own sources know it.
TEST(Layers, NoModuleIncludesAProtocol) {
  for (const std::string& path : Sources()) {
    for (const Include& include : IncludesOf(ReadFile(path))) {
      if (!include.header.starts_with("protocols/")) continue;
      const std::string folder = include.header.substr(0, include.header.find('/', 10) + 1);
      const bool plugin = fs::exists(folder + "protocol.cpp");
      EXPECT_TRUE(!plugin || path.starts_with(folder)) << path << " includes " << include.header;
    }
  }
}

TEST(Layers, FoldersOfTestsMirrorLayersAndModules) {
  const std::vector<Entry> table = TheTable();
  for (const auto& entry : fs::recursive_directory_iterator("tests/gateway")) {
    if (!entry.is_directory()) continue;
    const std::string folder = entry.path().string().substr(std::string("tests/").size());
    const bool mirrors = std::ranges::any_of(table, [&](const Entry& module) {
      return module.name == folder || module.name.starts_with(folder + "/");
    });
    EXPECT_TRUE(mirrors) << entry.path() << " mirrors no module";
  }
}

TEST(Layers, EachLayerOfTheGatewayAndEachProtocolHasAReadme) {
  for (const char* top : {"gateway", "protocols"}) {
    for (const auto& entry : fs::directory_iterator(top)) {
      if (!entry.is_directory()) continue;
      EXPECT_TRUE(fs::exists(entry.path() / "README.md")) << entry.path();
    }
  }
}

constexpr std::string_view kTable =
    "# bottom to top\n"
    "base:\n"
    "  gateway/base\n"
    "bus: base\n"
    "  gateway/bus/points\n"
    "  gateway/bus/exchange: gateway/bus/points\n"
    "lines: base bus\n"
    "  gateway/lines\n";

TEST(Layers, AnIncludeThatRunsUpIsNamedWithItsLine) {
  const std::vector<Entry> table = ReadTable(kTable);
  const std::string source =
      "// an exchange that wants the line\n"
      "#include <string>\n"
      "#include \"gateway/base/text.h\"\n"
      "#include \"gateway/bus/points/point_store.h\"\n"
      "#include \"gateway/lines/lines.h\"\n";
  EXPECT_THAT(WrongIncludes(table, "gateway/bus/exchange/line.cpp", source),
              ElementsAre("gateway/bus/exchange/line.cpp:5: gateway/bus/exchange may not include "
                          "gateway/lines/lines.h"));
}

TEST(Layers, InItsOwnLayerAModuleIncludesOnlyWhatItNames) {
  const std::vector<Entry> table = ReadTable(kTable);
  EXPECT_THAT(WrongIncludes(table, "gateway/bus/points/point_store.h",
                            "#include \"gateway/bus/exchange/line.h\"\n"),
              ElementsAre("gateway/bus/points/point_store.h:1: gateway/bus/points may not include "
                          "gateway/bus/exchange/line.h"));
  EXPECT_THAT(
      WrongIncludes(table, "gateway/lines/lines.h", "#include \"gateway/bus/exchange/line.h\"\n"),
      IsEmpty());
}

TEST(Layers, AFolderThatIsNoModuleIsNamed) {
  EXPECT_THAT(WrongIncludes(ReadTable(kTable), "gateway/attic/box.cpp", ""),
              ElementsAre("gateway/attic/box.cpp: gateway/attic is not in docs/modules.txt"));
}

TEST(Layers, ANameThatStandsBelowIsNamed) {
  EXPECT_THAT(WrongNames(ReadTable("base: bus\n  a: b\n  b\nbus:\n")),
              ElementsAre("base names bus, which does not stand above it",
                          "a names b, which does not stand above it"));
}

}  // namespace
}  // namespace baudgate::layers
