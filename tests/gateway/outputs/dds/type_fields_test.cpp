// The list of fields, and the DDS-XML that is made of it, say what baudgate.idl says.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "gateway/outputs/dds/published_types.h"

namespace baudgate::dds {
namespace {

/// "@key string<64> gateway" of each field, by struct.
using Types = std::map<std::string, std::vector<std::string>>;

/// Tests run at the root of the tree.
std::string Read(const std::string& name) {
  std::ifstream file("gateway/outputs/dds/" + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<std::smatch> Matches(const std::string& text, const std::string& pattern) {
  static std::map<std::string, std::regex> made;
  const std::regex& regex = made.try_emplace(pattern, pattern).first->second;
  return {std::sregex_iterator(text.begin(), text.end(), regex), std::sregex_iterator()};
}

Types OfIdl() {
  const std::string text = Read("baudgate.idl");
  Types types;
  for (const auto& found : Matches(text, R"(struct (\w+) \{([^}]*)\})")) {
    const std::string body = found[2];
    for (const auto& field : Matches(body, R"(\s*([^;]+?)\s+(\w+);)")) {
      types[found[1]].push_back(field[1].str() + " " + field[2].str());
    }
  }
  return types;
}

Types OfXml() {
  const std::map<std::string, std::string> idl = {
      {"boolean", "boolean"},      {"float64", "double"},  {"uint16", "unsigned short"},
      {"uint32", "unsigned long"}, {"int64", "long long"}, {"uint64", "unsigned long long"}};
  const std::string text = TypesXml();
  Types types;
  for (const auto& found :
       Matches(text, R"re(<struct name="(\w+)" extensibility="final">([\s\S]*?)</struct>)re")) {
    const std::string body = found[2];
    for (
        const auto& field : Matches(
            body,
            R"re(<member name="(\w+)" type="(\w+)"(?: stringMaxLength="(\d+)")?( key="true")?/>)re")) {
      const std::string type =
          field[2] == "string" ? "string<" + field[3].str() + ">" : idl.at(field[2]);
      types[found[1]].push_back((field[4].matched ? "@key " : "") + type + " " + field[1].str());
    }
  }
  return types;
}

std::string TypeName(const TypeField& field) {
  switch (field.kind) {
    case TypeField::Kind::text:
      return "string<" + std::to_string(field.bound) + ">";
    case TypeField::Kind::boolean:
      return "boolean";
    case TypeField::Kind::float64:
      return "double";
    case TypeField::Kind::uint16:
      return "unsigned short";
    case TypeField::Kind::uint32:
      return "unsigned long";
    case TypeField::Kind::int64:
      return "long long";
    case TypeField::Kind::uint64:
      return "unsigned long long";
  }
  return "?";
}

std::vector<std::string> Announced(const TypeDescription& type) {
  std::vector<std::string> fields;
  for (const TypeField& field : type.fields) {
    fields.push_back((field.key ? "@key " : "") + TypeName(field) + " " + std::string(field.name));
  }
  return fields;
}

TEST(TypeFields, AreThoseOfTheIdl) {
  Types types;
  ForEachType(
      [&types](const TypeDescription& type) { types[std::string(type.name)] = Announced(type); });
  EXPECT_EQ(types, OfIdl());
}

TEST(TypeFields, TheXmlSaysWhatTheIdlSays) { EXPECT_EQ(OfXml(), OfIdl()); }

}  // namespace
}  // namespace baudgate::dds
