// SPDX-License-Identifier: Apache-2.0
#include "config/identity.h"

#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostNames = 64;
constexpr std::size_t kLongestName = 64;

/// Calls `take` with each entry of each profile.
template <typename Take>
void ReadEntriesOfAll(const Catalog& catalog, const Protocol& protocol, Take take) {
  for (const ProfileFile& file : catalog.Profiles(std::string(protocol.name))) {
    // Errors in the file are reported when a device uses it.
    Problems unheard;
    const auto text = ReadWholeFile(file.path.string());
    const auto root = text ? ParseYaml(file.path.string(), *text, unheard) : std::nullopt;
    if (!root || root->kind() != YamlNode::Kind::map) continue;
    for (const Entry& entry : ReadEntries(*root, "profile", unheard)) take(file, entry, unheard);
  }
}

}  // namespace

std::vector<std::string> ReadIdentityNames(const YamlNode& node, Problems& problems) {
  std::vector<std::string> names;
  for (const YamlNode& element : ReadList(node, "identity", kMostNames, problems)) {
    const auto name = ReadText(element, "identity", problems);
    if (!name) continue;
    if (SpokenName(*name).empty() || name->size() > kLongestName) {
      problems.Error(element.mark(), "identity: " + Quoted(*name) +
                                         " is no name of 1 to 64 characters that a device has");
      continue;
    }
    names.push_back(*name);
  }
  return names;
}

Identity ReadIdentity(MapReader& map, const std::vector<std::string>& of_profile) {
  Identity identity;
  identity.names = of_profile;
  const auto node = map.Get("identity");
  if (!node) return identity;
  if (node->kind() == YamlNode::Kind::scalar && node->text() == "ignore") {
    identity.ignore = true;
  } else if (node->kind() == YamlNode::Kind::scalar) {
    map.problems().Error(node->mark(), "identity: " + Quoted(node->text()) +
                                           " is neither 'ignore' nor a list of names");
  } else {
    identity.names = ReadIdentityNames(*node, map.problems());
  }
  return identity;
}

std::map<std::string, std::string> ListedNames(const Catalog& catalog, const Protocol& protocol) {
  std::map<std::string, std::string> listed;
  ReadEntriesOfAll(catalog, protocol, [&](const auto& file, const Entry& entry, Problems& unheard) {
    if (entry.key != "identity") return;
    for (const std::string& name : ReadIdentityNames(entry.value, unheard)) {
      listed.emplace(SpokenName(name), file.name);
    }
  });
  return listed;
}

std::map<std::string, std::string> NamesAndTitles(const Catalog& catalog,
                                                  const Protocol& protocol) {
  std::map<std::string, std::string> listed = ListedNames(catalog, protocol);
  ReadEntriesOfAll(catalog, protocol, [&](const auto& file, const Entry& entry, Problems& unheard) {
    if (entry.key != "device") return;
    if (const auto title = ReadText(entry.value, "device", unheard)) {
      listed.emplace(SpokenName(*title), file.name);
    }
  });
  return listed;
}

}  // namespace baudgate::config
