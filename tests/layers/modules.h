// The table of layers and modules (docs/modules.txt), and the includes of a source held against it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::layers {

/// A line of the table: a layer at the margin, or a module of the layer above it.
struct Entry {
  std::string name;              ///< "bus", or the folder "gateway/bus/exchange"
  std::string layer;             ///< of a module; empty: the entry is a layer
  std::vector<std::string> may;  ///< layers that a layer includes; modules of its own layer
};

/// Bottom to top, as the table has them.
std::vector<Entry> ReadTable(std::string_view table);

/// An include of one of our own headers: `#include "gateway/bus/exchange/line.h"` in line 12.
struct Include {
  int line = 0;
  std::string header;
};
std::vector<Include> IncludesOf(std::string_view source);

/// "gateway/bus/exchange" of "gateway/bus/exchange/line.h".
std::string FolderOf(std::string_view path);

/// One sentence for each include of `path` that its module may not have:
/// "gateway/bus/exchange/line.cpp:12: gateway/bus/exchange may not include gateway/lines/lines.h".
/// What `path` uses of the table is added to `used`: "LAYER|NAME" of an entry → names in its `may`.
std::vector<std::string> WrongIncludes(
    const std::vector<Entry>& table, const std::string& path, std::string_view source,
    std::map<std::string, std::set<std::string>>* used = nullptr);

/// One sentence for each name in the table that does not stand above its entry.
std::vector<std::string> WrongNames(const std::vector<Entry>& table);

}  // namespace baudgate::layers
