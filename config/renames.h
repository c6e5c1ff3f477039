// Spellings that an older baudgate took and this one has other words for, in one table: the loader
// takes them with a warning, `baudgate config migrate` rewrites them. Only what means nothing else
// today can stand in it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/problem.h"
#include "config/yaml/yaml_source.h"

namespace baudgate::config {

/// Either a key or the value of a key has another name now.
///
///     { "lines.devices", "set4tm", "snapshot", "yes", "", "true", "0.1.0" }
struct Rename {
  std::string_view path;      ///< of the map; lists are entered. A profile is one of lines.devices
  std::string_view protocol;  ///< of the device; empty: any
  std::string_view key;
  std::string_view value;      ///< empty: the key has another name, whatever stands there
  std::string_view key_now;    ///< empty: as before
  std::string_view value_now;  ///< empty: as before
  std::string_view since;      ///< the first version that knows the new name
};

std::span<const Rename> Renames();

enum class FileKind : std::uint8_t { configuration, profile };

/// One place of a file.
struct Renamed {
  Mark mark;
  std::size_t offset = 0;  ///< of the word, in bytes from the begin of the text
  std::string key;         ///< as it was
  std::string was;
  std::string now;
  std::string since;

  /// "snapshot: 'yes' is 'true' since baudgate 0.1.0".
  std::string ToString() const;
};

/// Changes the tree of `root` (not its text) to the words of today; to be called before it is read.
/// `protocol`: of a profile, whose file does not say it.
std::vector<Renamed> ApplyRenames(const YamlNode& root, FileKind kind, std::string_view protocol,
                                  std::span<const Rename> renames = Renames());

/// ApplyRenames, and a warning for each.
void TakeRenames(const YamlNode& root, FileKind kind, std::string_view protocol,
                 Problems& problems);

/// The text with the new words; all else in it, comments too, stays as it is. A problem for a word
/// that does not stand at its place as such (behind an anchor or a tag).
std::string RewriteText(const std::string& text, std::vector<Renamed> renamed, Problems& problems);

}  // namespace baudgate::config
