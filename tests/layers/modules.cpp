// SPDX-License-Identifier: Apache-2.0
#include "tests/layers/modules.h"

#include <algorithm>
#include <sstream>

namespace baudgate::layers {
namespace {

/// `is_layer` is needed because a layer and a module can have the same name.
const Entry* Find(const std::vector<Entry>& table, std::string_view name, bool is_layer) {
  const auto found = std::ranges::find_if(table, [&](const Entry& entry) {
    return entry.name == name && entry.layer.empty() == is_layer;
  });
  return found == table.end() ? nullptr : &*found;
}

}  // namespace

std::vector<Entry> ReadTable(std::string_view table) {
  std::vector<Entry> entries;
  std::string layer;
  std::istringstream lines{std::string(table)};
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    Entry& entry = entries.emplace_back();
    std::istringstream words(line);
    std::getline(words >> std::ws, entry.name, ':');
    if (line[0] == ' ') {
      entry.layer = layer;
    } else {
      layer = entry.name;
    }
    for (std::string word; words >> word;) entry.may.push_back(word);
  }
  return entries;
}

std::vector<Include> IncludesOf(std::string_view source) {
  constexpr std::string_view kStart = "#include \"";
  std::vector<Include> includes;
  std::istringstream lines{std::string(source)};
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (!line.starts_with(kStart)) continue;
    const std::string rest = line.substr(kStart.size());
    includes.push_back({number, rest.substr(0, rest.find('"'))});
  }
  return includes;
}

std::string FolderOf(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string_view::npos ? std::string() : std::string(path.substr(0, slash));
}

std::vector<std::string> WrongIncludes(const std::vector<Entry>& table, const std::string& path,
                                       std::string_view source,
                                       std::map<std::string, std::set<std::string>>* used) {
  const std::string own = FolderOf(path);
  const Entry* module = Find(table, own, false);
  if (module == nullptr) return {path + ": " + own + " is not in docs/modules.txt"};
  const Entry* layer = Find(table, module->layer, true);
  std::vector<std::string> wrong;
  for (const Include& include : IncludesOf(source)) {
    const std::string folder = FolderOf(include.header);
    if (folder == own) continue;
    const Entry* other = Find(table, folder, false);
    const bool near = other != nullptr && other->layer == module->layer;
    const Entry* by = near ? module : layer;
    const std::string wanted = near || other == nullptr ? folder : other->layer;
    if (std::ranges::find(by->may, wanted) == by->may.end()) {
      wrong.push_back(path + ":" + std::to_string(include.line) + ": " + own + " may not include " +
                      include.header);
    } else if (used != nullptr) {
      (*used)[by->layer + "|" + by->name].insert(wanted);
    }
  }
  return wrong;
}

std::vector<std::string> WrongNames(const std::vector<Entry>& table) {
  std::vector<std::string> wrong;
  std::set<std::string> above;
  for (const Entry& entry : table) {
    for (const std::string& name : entry.may) {
      if (!above.contains(entry.layer + "|" + name)) {
        wrong.push_back(entry.name + " names " + name + ", which does not stand above it");
      }
    }
    above.insert(entry.layer + "|" + entry.name);
  }
  return wrong;
}

}  // namespace baudgate::layers
