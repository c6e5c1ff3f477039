// SPDX-License-Identifier: Apache-2.0
#include "config/profile.h"

#include "config/events.h"
#include "config/identity.h"
#include "config/options.h"
#include "config/records.h"
#include "config/serial.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

namespace fs = std::filesystem;

constexpr std::array<Word<WordOrder>, 4> kWordOrders = {{{"ABCD", WordOrder::abcd},
                                                         {"CDAB", WordOrder::cdab},
                                                         {"BADC", WordOrder::badc},
                                                         {"DCBA", WordOrder::dcba}}};

}  // namespace

std::optional<WordOrder> ReadWordOrder(MapReader& map) {
  return map.OneOf("word_order", kWordOrders);
}

Result<fs::path> LocateProfile(const std::string& profile, const Protocol& protocol,
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
                           const std::string& name, const Protocol& protocol, Problems& problems) {
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
  profile.word_order = ReadWordOrder(map);
  if (const auto names = map.Get("identity"))
    profile.identity = ReadIdentityNames(*names, problems);
  profile.options = ReadOptions(map, protocol, OptionSpec::Scope::device);
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

RawProfile ReadProfile(const fs::path& path, const Protocol& protocol, Problems& problems) {
  const auto text = ReadWholeFile(path.string());
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
