// Reads the table of layers and modules (docs/modules.txt), and checks includes against it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::layers {

/// An entry of the table: a layer (not indented), or a module of the layer above it.
struct Entry {
  std::string name;
  std::string layer;
  /// The layers, or the modules of the same layer, that this entry is allowed to include.
  std::vector<std::string> may;
};

std::vector<Entry> ReadTable(std::string_view table);

struct Include {
  int line = 0;
  std::string header;
};
std::vector<Include> IncludesOf(std::string_view source);

/// Example: returns "gateway/bus/exchange" for "gateway/bus/exchange/line.h".
std::string FolderOf(std::string_view path);

/// Returns one sentence for each forbidden include of `path`. Example:
/// "gateway/bus/exchange/line.cpp:12: gateway/bus/exchange may not include gateway/lines/lines.h".
/// If `used` is given, adds what the includes need: for an entry "LAYER|NAME", the names from its
/// `may`.
std::vector<std::string> WrongIncludes(
    const std::vector<Entry>& table, const std::string& path, std::string_view source,
    std::map<std::string, std::set<std::string>>* used = nullptr);

/// Returns one sentence for each name that an entry uses before the table defines it.
std::vector<std::string> WrongNames(const std::vector<Entry>& table);

}  // namespace baudgate::layers
