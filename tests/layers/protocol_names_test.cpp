// gateway/outputs/status and gateway/diagnosis decide nothing by the name of a protocol: what is
// particular to one is told by its plugin (config/model/options.h), so that a new protocol needs no
// change there.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>

namespace baudgate::layers {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

namespace fs = std::filesystem;

std::string ReadAll(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// "spabus|dcon|…|telegram", from the list that registers protocols.
std::string NamesIn(const std::string& list) {
  std::smatch found;
  if (!std::regex_search(list, found, std::regex(R"(set\(baudgate_protocols ([^)]*)\))")))
    return {};
  const std::string names = std::regex_replace(found[1].str(), std::regex(R"(\w+:)"), "");
  return std::regex_replace(names, std::regex(R"(\s+)"), "|");
}

/// Literals that are a name, or that ask the user to set one, and names that are taken apart.
std::vector<std::string> NamedIn(const std::string& source, const std::string& names) {
  const std::regex named("\"(?:" + names + ")\"|protocol: (?:" + names +
                         ")\\b|protocol(?:\\.|->)(?:starts_with|ends_with|find|contains)\\b");
  std::vector<std::string> all;
  for (std::sregex_iterator at(source.begin(), source.end(), named), end; at != end; ++at) {
    all.push_back(at->str());
  }
  return all;
}

TEST(ProtocolNames, StandInNoSourceOfTheStatus) {
  const std::string names = NamesIn(ReadAll("protocols/CMakeLists.txt"));
  EXPECT_THAT(names, testing::HasSubstr("|modbus_tcp|"));
  for (const char* folder : {"gateway/outputs/status", "gateway/diagnosis/causes"}) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      EXPECT_THAT(NamedIn(ReadAll(entry.path()), names), IsEmpty()) << entry.path();
    }
  }
}

TEST(ProtocolNames, AreFoundWhereTheyStand) {
  const std::string names = NamesIn("set(baudgate_protocols spabus modbus:modbus_rtu reader)\n");
  EXPECT_EQ(names, "spabus|modbus_rtu|reader");
  EXPECT_THAT(NamedIn("if (protocol == \"spabus\" || protocol.starts_with(\"mod\"))\n"
                      "  return \"set protocol: modbus_rtu at the line\";  // of the reader\n",
                      names),
              ElementsAre("\"spabus\"", "protocol.starts_with", "protocol: modbus_rtu"));
}

}  // namespace
}  // namespace baudgate::layers
