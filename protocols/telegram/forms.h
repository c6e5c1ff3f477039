// Reads how one telegram is composed: the keys of a description for its bytes, its end and its
// check value. Part of compile.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/yaml/yaml_reader.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

/// Settings of `all:` that a telegram may override.
struct Framing {
  Bytes ends{};
  Checksum checksum{};
  bool answers_have_it = true;    ///< answers have the check value, too; else only sent telegrams
  bool unknown_checksum = false;  ///< the check value could not be read
  std::optional<SizeField> size_at{};
  std::vector<config::YamlNode> refused{};
  Duration idle{};
  bool strict = false;
};

/// Returns the place in the file of character `at` of the node's text.
config::Mark PlaceIn(const config::YamlNode& node, std::size_t at);

/// Reads bytes that are written as a pattern without fields.
std::optional<Bytes> ReadFixed(const config::YamlNode& node, const std::string& what,
                               config::Problems& problems);

/// Reads the framing in `map`; missing keys are taken from `all`.
Framing ReadFraming(config::MapReader& map, const Framing& all);

/// Reads `send`, `receive`, `refused`, `size` and `fields` of `map` into `telegram`.
void ReadForms(config::MapReader& map, const Framing& framing, std::size_t most,
               Telegram& telegram);

}  // namespace baudgate::protocols::telegram
