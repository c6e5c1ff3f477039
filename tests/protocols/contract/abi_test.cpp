// SPDX-License-Identifier: Apache-2.0
#include "protocols/abi.h"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace baudgate {
namespace {

std::string TextOf(const std::string& path) {
  std::ifstream file(path);  // tests run at the root of the source tree
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// "Conversation::Queries", … for each virtual function of the header, destructors left out.
std::vector<std::string> VirtualFunctions(const std::string& header) {
  const std::regex line(R"(class (\w+) \{|virtual [^~;{]*?(\w+)\()");
  std::vector<std::string> functions;
  std::string name;
  for (std::sregex_iterator found(header.begin(), header.end(), line), end; found != end; ++found) {
    if ((*found)[1].matched) {
      name = (*found)[1];
    } else {
      functions.push_back(name + "::" + std::string((*found)[2]));
    }
  }
  return functions;
}

TEST(ContractTag, CountsEveryVirtualFunctionInItsOrder) {
  const std::string tag = TextOf("protocols/abi.h");
  for (const char* header : {"conversation", "twin", "protocol"}) {
    const auto functions = VirtualFunctions(TextOf("protocols/" + std::string(header) + ".h"));
    std::size_t last = 0;
    for (const std::string& function : functions) {
      const std::size_t at = tag.find("&" + function);
      ASSERT_NE(at, std::string::npos) << "list " << function << " in protocols/abi.h";
      EXPECT_GT(at, last) << function << " stands elsewhere in its class";
      last = at;
    }
  }
  EXPECT_EQ(
      VirtualFunctions(TextOf("protocols/twin.h")),
      (std::vector<std::string>{"TwinValues::Get", "TwinValues::Set", "Twin::Answer",
                                "Twin::ReplyAs", "Twin::SetClock", "Twin::Raise", "Twin::Say"}));
  EXPECT_EQ(VirtualFunctions(TextOf("protocols/conversation.h")).size(), 26U);
}

// Pairs of structs and enums as a change of the contract would make them.
namespace before {
struct Request {
  int first = 0;
  bool flag = false;
};
enum class Then : std::uint8_t { done, again };
}  // namespace before
namespace after {
struct Request {  // the same size: the new field fits into the padding
  int first = 0;
  bool flag = false;
  bool closes = false;
};
enum class Then : std::uint8_t { again, done };
}  // namespace after

}  // namespace

namespace abi {

/// The names of the two namespaces differ as well: hash what does not contain them.
template <typename T>
std::string Enumerators() {
  const std::string all(EnumeratorsOf<T>(std::make_index_sequence<3>()));
  return std::regex_replace(all, std::regex("before|after"), "");
}

TEST(ContractTag, ChangesWithFieldsInPaddingAndWithTheOrderOfEnumerators) {
  static_assert(sizeof(before::Request) == sizeof(after::Request));
  EXPECT_NE(HashAll(Types<int, bool>()), HashAll(Types<int, bool, bool>()));
  before::Request old;
  after::Request fresh;
  EXPECT_NE(HashAll(decltype(Split(old, Fields<2>()))()),
            HashAll(decltype(Split(fresh, Fields<3>()))()));
  EXPECT_NE(Enumerators<before::Then>(), Enumerators<after::Then>());
  EXPECT_NE(Hash<int (*)(bool)>(), Hash<int (*)(bool, bool)>());
}

TEST(ContractTag, NamesCompilerAndContract) {
  EXPECT_TRUE(std::regex_match(kTag, std::regex("gcc\\d+-cxxabi\\d+ contract [0-9a-f]{16}")))
      << kTag;
}

}  // namespace abi
}  // namespace baudgate
