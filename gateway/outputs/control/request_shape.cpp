// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/request_shape.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "gateway/base/spelling.h"

namespace baudgate::control {
namespace {

using Type = Member::Type;

bool IsWhole(const Json& value) {
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (value.is_number_unsigned()) return value.get<std::uint64_t>() <= kMost;
  return value.is_number_integer();
}

bool Is(Type type, const Json& value) {
  switch (type) {
    case Type::text:
      return value.is_string();
    case Type::flag:
      return value.is_boolean();
    case Type::whole:
      return IsWhole(value);
    case Type::two_wholes:
      break;
  }
  return value.is_array() && value.size() == 2 && std::all_of(value.begin(), value.end(), IsWhole);
}

std::string_view Words(Type type) {
  constexpr std::array<std::string_view, 4> kWords = {"a text in quotation marks", "true or false",
                                                      "a whole number", "two whole numbers in [ ]"};
  return kWords[static_cast<std::size_t>(type)];
}

/// Short enough for a sentence, whatever a client sends.
std::string Shown(const Json& value) {
  constexpr std::size_t kMost = 40;
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > kMost) text = text.substr(0, kMost) + "…";
  return text;
}

}  // namespace

Status CheckShape(const Command& command, const Json& request) {
  std::vector<std::string_view> names;
  for (const Member& member : command.members) names.push_back(member.name);
  for (const auto& [name, value] : request.items()) {
    if (name == "command") continue;
    const auto member = std::ranges::find(command.members, name, &Member::name);
    if (member == command.members.end()) {
      return Error{config::Quoted(name) + " is no member of " + config::Quoted(command.name) + ";" +
                   config::DidYouMean(name, names) +
                   (names.empty() ? " it has none" : " there are: " + config::Join(names))};
    }
    if (Is(member->type, value)) continue;
    return Error{config::Quoted(name) + " of " + config::Quoted(command.name) + " is " +
                 std::string(Words(member->type)) + ", and not " + Shown(value)};
  }
  return {};
}

}  // namespace baudgate::control
