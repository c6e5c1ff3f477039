// Reads how one telegram is composed: the keys of a description for its bytes, its end and its
// check value. compile.h uses this part.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/yaml/yaml_reader.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

/// The keys of the entry `all:` of a description. Keys of a single telegram override them.
struct Framing {
  Bytes ends{};
  Checksum checksum{};
  /// True: answers have the check value, too; false: only sent telegrams have it.
  bool answers_have_it = true;
  bool unknown_checksum = false;  ///< true: the description of the check value has an error
  std::optional<SizeField> size_at{};
  std::vector<config::YamlNode> refused{};
  Duration idle{};
  bool strict = false;
};

/// Returns the position in the file of the character `at` in the node's text.
config::Mark PlaceIn(const config::YamlNode& node, std::size_t at);

/// Reads bytes that are written as a pattern without fields. Empty: there is an error, which is
/// reported.
std::optional<Bytes> ReadFixed(const config::YamlNode& node, const std::string& what,
                               config::Problems& problems);

/// Reads the framing in `map`; missing keys are taken from `all`.
Framing ReadFraming(config::MapReader& map, const Framing& all);

/// Reads the keys `send`, `receive`, `refused`, `size` and `fields` of `map` into `telegram`.
void ReadForms(config::MapReader& map, const Framing& framing, std::size_t most,
               Telegram& telegram);

}  // namespace baudgate::protocols::telegram
