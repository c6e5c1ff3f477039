// How one telegram is put together: the keys of a description that say where its bytes stand, where
// it ends and what guards it. Part of compile.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/yaml/yaml_reader.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

/// What `all:` says, and a telegram may say otherwise.
struct Framing {
  Bytes ends{};
  Checksum checksum{};
  bool answers_have_it = true;    ///< the check value; else only what is sent has it
  bool unknown_checksum = false;  ///< it could not be read
  std::optional<SizeField> size_at{};
  std::vector<config::YamlNode> refused{};
  Duration idle{};
  bool strict = false;
};

/// The place of a character of the node's text.
config::Mark PlaceIn(const config::YamlNode& node, std::size_t at);

/// Bytes that are written as a pattern without fields.
std::optional<Bytes> ReadFixed(const config::YamlNode& node, const std::string& what,
                               config::Problems& problems);

/// Takes what of the framing stands in `map`; the rest is as in `all`.
Framing ReadFraming(config::MapReader& map, const Framing& all);

/// `send`, `receive`, `refused`, `size` and `fields` of `map`.
void ReadForms(config::MapReader& map, const Framing& framing, std::size_t most,
               Telegram& telegram);

}  // namespace baudgate::protocols::telegram
