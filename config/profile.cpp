// SPDX-License-Identifier: Apache-2.0
#include "config/profile.h"

#include "config/catalog/option_values.h"
#include "config/events.h"
#include "config/history.h"
#include "config/lines.h"
#include "gateway/base/text.h"
#include "gateway/base/trusted_file.h"

namespace baudgate::config {

namespace {

std::optional<OptionValue> ReadTexts(const YamlNode& node, const std::string& name,
                                     Problems& problems) {
  std::vector<std::string> texts;
  for (const YamlNode& element : ReadList(node, name, 1000, problems)) {
    if (auto text = ReadText(element, name, problems)) texts.push_back(std::move(*text));
  }
  return texts;
}

std::optional<OptionValue> ReadPairs(const YamlNode& node, const std::string& name,
                                     Problems& problems) {
  Pairs pairs;
  for (const Entry& entry : ReadEntries(node, name, problems)) {
    if (auto text = ReadText(entry.value, name, problems)) pairs[entry.key] = std::move(*text);
  }
  return pairs;
}

std::optional<OptionValue> ReadOption(const YamlNode& node, const protocols::OptionSpec& spec,
                                      const protocols::Protocol& protocol, Problems& problems) {
  const std::string name(spec.name);
  if (spec.kind == protocols::OptionSpec::Kind::description) {
    return DescriptionRef{protocol.describe(node, problems)};
  }
  if (spec.kind == protocols::OptionSpec::Kind::pairs && node.kind() == YamlNode::Kind::map) {
    return ReadPairs(node, name, problems);
  }
  if (spec.kind == protocols::OptionSpec::Kind::texts && node.kind() == YamlNode::Kind::list) {
    return ReadTexts(node, name, problems);
  }
  const auto text = ReadText(node, name, problems);
  if (!text) return std::nullopt;
  // A text is used unchanged, including commas; commas separate only the elements of a list.
  auto value = ParseOption(spec, *text);
  if (value) return std::move(*value);
  problems.Error(node.mark(), name + ": " + value.error());
  return std::nullopt;
}

/// Returns the value as written; lists and pairs in the form of `--set`.
std::string WrittenText(const YamlNode& node, const OptionValue& value) {
  if (const auto* pairs = std::get_if<Pairs>(&value)) {
    std::string joined;
    for (const auto& [word, text] : *pairs) {
      joined += (joined.empty() ? "" : ",") + word + "=" + text;
    }
    return joined;
  }
  const auto* texts = std::get_if<std::vector<std::string>>(&value);
  if (texts == nullptr) return std::string(node.text());
  std::string joined;
  for (const std::string& text : *texts) joined += (joined.empty() ? "" : ",") + text;
  return joined;
}

}  // namespace

Options ReadOptions(MapReader& map, const protocols::Protocol& protocol,
                    protocols::OptionSpec::Scope scope) {
  Options options;
  for (const protocols::OptionSpec& spec : protocol.options) {
    if (spec.scope != scope) {
      map.Refuse(spec.name,
                 "'" + std::string(spec.name) + "' belongs to the " +
                     (scope == protocols::OptionSpec::Scope::line ? "devices, not to the line"
                                                                  : "line, not to its devices"));
      continue;
    }
    const auto node = map.Get(spec.name);
    if (!node) continue;
    if (auto value = ReadOption(*node, spec, protocol, map.problems())) {
      const bool shown = !spec.secret && spec.kind != protocols::OptionSpec::Kind::description;
      if (shown) options.SetWritten(std::string(spec.name), WrittenText(*node, *value));
      options.Set(std::string(spec.name), std::move(*value));
    }
  }
  return options;
}

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNames = 64;
constexpr std::size_t kLongestName = 64;

template <typename Take>
void ReadEntriesOfAll(const Catalog& catalog, const protocols::Protocol& protocol, Take take) {
  for (const ProfileFile& file : catalog.Profiles(std::string(protocol.name))) {
    // Errors in the file are reported when a device uses it.
    Problems unheard;
    const auto text = ReadWholeFile(file.path.string());
    const auto root = text ? ParseYaml(file.path.string(), *text, unheard) : std::nullopt;
    if (!root || root->kind() != YamlNode::Kind::map) continue;
    for (const Entry& entry : ReadEntries(*root, "profile", unheard)) take(file, entry, unheard);
  }
}

std::vector<std::string> ReadIdentityNames(const YamlNode& node, Problems& problems) {
  std::vector<std::string> names;
  for (const YamlNode& element : ReadList(node, "identity", kMostNames, problems)) {
    const auto name = ReadText(element, "identity", problems);
    if (!name) continue;
    if (SpokenName(*name).empty() || name->size() > kLongestName) {
      problems.Error(element.mark(),
                     "identity: " + Quoted(*name) + " is not a device name of 1 to 64 characters");
      continue;
    }
    names.push_back(*name);
  }
  return names;
}

}  // namespace

Identity ReadIdentity(MapReader& map, const std::vector<std::string>& of_profile) {
  Identity identity;
  identity.names = of_profile;
  const auto node = map.Get("identity");
  if (!node) return identity;
  if (node->kind() == YamlNode::Kind::scalar && node->text() == "ignore") {
    identity.ignore = true;
  } else if (node->kind() == YamlNode::Kind::scalar) {
    map.problems().Error(
        node->mark(),
        "identity: " + Quoted(node->text()) +
            " is neither 'ignore' nor a list of names; write for example identity: [\"NAME\"]");
  } else {
    identity.names = ReadIdentityNames(*node, map.problems());
  }
  return identity;
}

std::map<std::string, std::string> ListedNames(const Catalog& catalog,
                                               const protocols::Protocol& protocol) {
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
                                                  const protocols::Protocol& protocol) {
  std::map<std::string, std::string> listed = ListedNames(catalog, protocol);
  ReadEntriesOfAll(catalog, protocol, [&](const auto& file, const Entry& entry, Problems& unheard) {
    if (entry.key != "device") return;
    if (const auto title = ReadText(entry.value, "device", unheard)) {
      listed.emplace(SpokenName(*title), file.name);
    }
  });
  return listed;
}

Result<fs::path> LocateProfile(const std::string& profile, const protocols::Protocol& protocol,
                               const Catalog& catalog, const fs::path& base) {
  if (IsProfilePath(profile)) return base / profile;
  const std::string owner(protocol.name);
  if (auto path = catalog.FindProfile(owner, profile)) return std::move(*path);
  const std::vector<ProfileFile> files = catalog.Profiles(owner);
  std::vector<std::string_view> names;
  for (const ProfileFile& file : files) names.push_back(file.name);
  std::string searched;
  for (const std::string& folder : catalog.ProfileOwners(owner)) {
    for (const fs::path& dir : catalog.profile_dirs) {
      searched += (searched.empty() ? "" : ", ") + (dir / folder).string();
    }
  }
  return Error{Quoted(profile) + " is not installed for " + owner + ";" +
               DidYouMean(profile, names) +
               " installed: " + (names.empty() ? "none" : Join(names)) + " (searched " +
               (searched.empty() ? "nowhere" : searched) + ")"};
}

RawProfile ReadProfileText(const std::string& text, const std::string& file,
                           const std::string& name, const protocols::Protocol& protocol,
                           Problems& problems) {
  RawProfile raw;
  raw.file = file;
  Profile& profile = raw.profile;
  profile.name = name;
  profile.protocol = std::string(protocol.name);
  const auto root = ParseYaml(file, text, problems);
  if (!root) return raw;
  MapReader map(*root, "profile '" + name + "'", problems);
  if (map.Need("device", "ABB SPAJ 140 C")) Assign(profile.title, map.Label("device"));
  profile.pace = ReadPace(map, Level::profile);
  map.Read<&Profile::word_order>(profile);
  if (const auto names = map.Get("identity"))
    profile.identity = ReadIdentityNames(*names, problems);
  profile.options = ReadOptions(map, protocol, protocols::OptionSpec::Scope::device);
  if (const auto points = map.Need("points", "[ … ]")) {
    raw.points = ReadRawPoints(*points, problems);
  }
  if (const auto records = map.Get("records")) profile.records = ReadRecords(*records, problems);
  if (const auto events = map.Get("events")) {
    profile.event_texts = ReadEventTable(*events, profile.records, problems);
  }
  map.Finish();
  return raw;
}

RawProfile ReadProfile(const fs::path& path, const protocols::Protocol& protocol,
                       Problems& problems) {
  auto text = ReadWholeFile(path.string());
  if (const std::string why = WhyNotTrusted(path); text && !why.empty()) {
    text = Error{"is not used: " + why};
  }
  if (text) {
    return ReadProfileText(*text, path.string(), path.stem().string(), protocol, problems);
  }
  problems.Error({path.string(), 0, 0}, "profile " + text.error());
  RawProfile raw;
  raw.file = path.string();
  raw.profile.name = path.stem().string();
  raw.profile.protocol = std::string(protocol.name);
  return raw;
}

}  // namespace baudgate::config
