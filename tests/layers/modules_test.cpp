// Checks the source tree against docs/modules.txt, and that a forbidden include is found.
// SPDX-License-Identifier: Apache-2.0
#include "tests/layers/modules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <regex>

namespace baudgate::layers {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

namespace fs = std::filesystem;

std::string ReadFile(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

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

TEST(Layers, NoSourceIncludesAForbiddenModule) {
  const std::vector<Entry> table = TheTable();
  const std::vector<std::string> sources = Sources();
  for (const std::string& path : sources) {
    EXPECT_THAT(WrongIncludes(table, path, ReadFile(path)), IsEmpty());
  }
  EXPECT_GT(sources.size(), 300U);
}

TEST(Layers, EachEntryNamesOnlyEntriesAboveIt) { EXPECT_THAT(WrongNames(TheTable()), IsEmpty()); }

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

TEST(Layers, AnUpwardIncludeIsReportedWithItsLine) {
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

TEST(Layers, WithinItsLayerAModuleIncludesOnlyNamedModules) {
  const std::vector<Entry> table = ReadTable(kTable);
  EXPECT_THAT(WrongIncludes(table, "gateway/bus/points/point_store.h",
                            "#include \"gateway/bus/exchange/line.h\"\n"),
              ElementsAre("gateway/bus/points/point_store.h:1: gateway/bus/points may not include "
                          "gateway/bus/exchange/line.h"));
  EXPECT_THAT(
      WrongIncludes(table, "gateway/lines/lines.h", "#include \"gateway/bus/exchange/line.h\"\n"),
      IsEmpty());
}

TEST(Layers, AFolderThatIsNoModuleIsReported) {
  EXPECT_THAT(WrongIncludes(ReadTable(kTable), "gateway/attic/box.cpp", ""),
              ElementsAre("gateway/attic/box.cpp: gateway/attic is not in docs/modules.txt"));
}

TEST(Layers, ANameFromBelowIsReported) {
  EXPECT_THAT(WrongNames(ReadTable("base: bus\n  a: b\n  b\nbus:\n")),
              ElementsAre("base names bus, which does not stand above it",
                          "a names b, which does not stand above it"));
}

// ---------------- Each source file that a comment names must exist.

using Exists = std::function<bool(const std::string& path)>;

std::vector<std::string> MissingFiles(const std::string& path, std::istream& source,
                                      const Exists& exists) {
  static const std::regex kName(R"([\w./-]*\w\.(?:h|cpp)\b)");
  std::vector<std::string> missing;
  int number = 0;
  for (std::string line; std::getline(source, line);) {
    ++number;
    const std::size_t comment = line.find("//");
    if (comment == std::string::npos) continue;
    const std::string text = line.substr(comment + 2);
    for (std::sregex_iterator at(text.begin(), text.end(), kName), end; at != end; ++at) {
      const std::string name = at->str();
      const bool has_path = name.find('/') != std::string::npos;
      const std::string file = has_path ? name : FolderOf(path) + "/" + name;
      if (!exists(file)) {
        missing.push_back(path + ":" + std::to_string(number) + ": there is no " + file);
      }
    }
  }
  return missing;
}

TEST(FileNames, FilesNamedInCommentsExist) {
  for (const char* top : {"config", "protocols", "transports", "gateway"}) {
    for (const auto& entry : fs::recursive_directory_iterator(top)) {
      const std::string extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      std::ifstream source(entry.path());
      EXPECT_THAT(MissingFiles(entry.path().string(), source,
                               [](const std::string& path) { return fs::exists(path); }),
                  IsEmpty());
    }
  }
}

TEST(FileNames, AMissingFileIsReportedWithItsLine) {
  std::istringstream source(
      "// from session.cpp, by way of gateway/bus/exchange/line.h\n"
      "#include \"gateway/bus/gone.h\"\n"
      "int x;  // see modules.h\n");
  EXPECT_THAT(
      MissingFiles("gateway/bus/jobs/job.cpp", source,
                   [](const std::string& path) { return path == "gateway/bus/exchange/line.h"; }),
      ElementsAre("gateway/bus/jobs/job.cpp:1: there is no gateway/bus/jobs/session.cpp",
                  "gateway/bus/jobs/job.cpp:3: there is no gateway/bus/jobs/modules.h"));
}

// ---------------- gateway/outputs/status and gateway/diagnosis must not name a protocol, so that a
// new protocol needs no change there.

std::string ReadAll(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Returns, for example, "spabus|dcon|…|telegram" from the list that registers protocols.
std::string NamesIn(const std::string& list) {
  std::smatch found;
  if (!std::regex_search(list, found, std::regex(R"(set\(baudgate_protocols ([^)]*)\))")))
    return {};
  const std::string names = std::regex_replace(found[1].str(), std::regex(R"(\w+:)"), "");
  return std::regex_replace(names, std::regex(R"(\s+)"), "|");
}

/// Returns string literals with a protocol name, and comparisons of parts of a protocol name.
std::vector<std::string> NamedIn(const std::string& source, const std::string& names) {
  const std::regex named("\"(?:" + names + ")\"|protocol: (?:" + names +
                         ")\\b|protocol(?:\\.|->)(?:starts_with|ends_with|find|contains)\\b");
  std::vector<std::string> all;
  for (std::sregex_iterator at(source.begin(), source.end(), named), end; at != end; ++at) {
    all.push_back(at->str());
  }
  return all;
}

TEST(ProtocolNames, AreNotUsedInSourcesOfTheStatus) {
  const std::string names = NamesIn(ReadAll("protocols/CMakeLists.txt"));
  EXPECT_THAT(names, testing::HasSubstr("|modbus_tcp|"));
  for (const char* folder : {"gateway/outputs/status", "gateway/diagnosis/causes"}) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      EXPECT_THAT(NamedIn(ReadAll(entry.path()), names), IsEmpty()) << entry.path();
    }
  }
}

TEST(ProtocolNames, AreFoundInSourceText) {
  const std::string names = NamesIn("set(baudgate_protocols spabus modbus:modbus_rtu reader)\n");
  EXPECT_EQ(names, "spabus|modbus_rtu|reader");
  EXPECT_THAT(NamedIn("if (protocol == \"spabus\" || protocol.starts_with(\"mod\"))\n"
                      "  return \"set protocol: modbus_rtu at the line\";  // of the reader\n",
                      names),
              ElementsAre("\"spabus\"", "protocol.starts_with", "protocol: modbus_rtu"));
}

}  // namespace
}  // namespace baudgate::layers
