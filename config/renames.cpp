// SPDX-License-Identifier: Apache-2.0
#include "config/renames.h"

#include <algorithm>
#include <array>

#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::string_view kDevices = "lines.devices";
/// What aliases can multiply is bounded by the readers, which come later.
constexpr int kMostMaps = 100'000;

/// Of SET-4TM, snapshot was a flag before it was auto, true or false.
constexpr std::array<Rename, 4> kRenames = {
    {{kDevices, "set4tm", "snapshot", "yes", "", "true", "0.1.0"},
     {kDevices, "set4tm", "snapshot", "on", "", "true", "0.1.0"},
     {kDevices, "set4tm", "snapshot", "no", "", "false", "0.1.0"},
     {kDevices, "set4tm", "snapshot", "off", "", "false", "0.1.0"}}};

bool Is(const YAML::Node& node, std::string_view word) {
  return node.IsScalar() && node.Scalar() == word;
}

bool HasKey(const YAML::Node& map, std::string_view key) {
  return std::any_of(map.begin(), map.end(), [&](const auto& one) { return Is(one.first, key); });
}

/// One rename, looked for in the whole tree.
class Search {
 public:
  Search(const Rename& rename, std::shared_ptr<const Source> source, std::vector<Renamed>& found)
      : rename_(rename), source_(std::move(source)), found_(found) {}

  /// `path`: what is left of it. `protocol`: of what stands around.
  void Enter(const YAML::Node& node, std::string_view path, std::string protocol) {
    if (!node.IsMap() || --maps_left_ < 0) return;
    for (const auto& entry : node) {
      if (Is(entry.first, "protocol") && entry.second.IsScalar()) protocol = entry.second.Scalar();
    }
    if (path.empty()) return Look(node, protocol);
    const auto dot = path.find('.');
    const auto rest = dot == std::string_view::npos ? "" : path.substr(dot + 1);
    for (const auto& entry : node) {
      if (!Is(entry.first, path.substr(0, dot))) continue;
      Enter(entry.second, rest, protocol);
      if (!entry.second.IsSequence()) continue;
      for (const auto& element : entry.second) Enter(element, rest, protocol);
    }
  }

 private:
  void Look(const YAML::Node& map, const std::string& protocol) {
    if (!rename_.protocol.empty() && protocol != rename_.protocol) return;
    if (!rename_.key_now.empty() && HasKey(map, rename_.key_now)) return;
    for (const auto& entry : map) {
      if (!Is(entry.first, rename_.key)) continue;
      if (rename_.value.empty()) {
        Replace(entry.first, rename_.key_now);
      } else if (Is(entry.second, rename_.value)) {
        Replace(entry.second, rename_.value_now);
      }
    }
  }

  // A YAML::Node is a reference: its copy changes the tree.
  void Replace(YAML::Node node, std::string_view now) {
    const YAML::Mark mark = node.Mark();
    found_.push_back({source_->MarkAt(source_->At(mark)), source_->Offset(mark),
                      std::string(rename_.key), node.Scalar(), std::string(now),
                      std::string(rename_.since)});
    node = std::string(now);
  }

  const Rename& rename_;
  const std::shared_ptr<const Source> source_;
  std::vector<Renamed>& found_;
  int maps_left_ = kMostMaps;
};

}  // namespace

std::span<const Rename> Renames() { return kRenames; }

std::string Renamed::ToString() const {
  return (was == key ? std::string() : key + ": ") + Quoted(was) + " is " + Quoted(now) +
         " since baudgate " + since;
}

std::vector<Renamed> ApplyRenames(const YamlNode& root, FileKind kind, std::string_view protocol,
                                  std::span<const Rename> renames) {
  std::vector<Renamed> found;
  for (const Rename& rename : renames) {
    if (kind == FileKind::profile && rename.path != kDevices) continue;
    const auto path = kind == FileKind::profile ? std::string_view() : rename.path;
    Search(rename, root.source(), found).Enter(root.yaml(), path, std::string(protocol));
  }
  std::ranges::sort(found, {}, &Renamed::offset);
  return found;
}

void TakeRenames(const YamlNode& root, FileKind kind, std::string_view protocol,
                 Problems& problems) {
  const std::string of =
      kind == FileKind::profile ? "--protocol " + std::string(protocol) + " " : std::string();
  for (const Renamed& one : ApplyRenames(root, kind, protocol)) {
    problems.Warning(one.mark, one.ToString() + "; it is taken so, and 'baudgate config migrate " +
                                   of + one.mark.file + "' rewrites it");
  }
}

std::string RewriteText(const std::string& text, std::vector<Renamed> renamed, Problems& problems) {
  std::ranges::sort(renamed, std::ranges::greater(), &Renamed::offset);
  std::string rewritten = text;
  for (const Renamed& one : renamed) {
    const bool quoted = one.offset < text.size() && (text[one.offset] == '"' ||  // "yes"
                                                     text[one.offset] == '\'');
    const std::size_t at = std::min(one.offset + (quoted ? 1 : 0), text.size());
    if (text.compare(at, one.was.size(), one.was) == 0) {
      rewritten.replace(at, one.was.size(), one.now);
    } else {
      problems.Error(one.mark, one.ToString() +
                                   "; it can not be rewritten where it stands, change it by hand");
    }
  }
  return rewritten;
}

}  // namespace baudgate::config
