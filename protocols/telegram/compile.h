// From the YAML of a description to its telegrams. Everything that is wrong is said at once, each
// with line and column; nothing is left for the time when the line runs. CheckExamples runs the
// examples of a description.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "config/yaml/yaml_reader.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

/// Without a telegram where there is an error.
std::shared_ptr<const config::Description> Compile(const config::YamlNode& telegrams,
                                                   config::Problems& problems);

// The examples of a description, run: what is sent is built from the pattern byte by byte, and what
// comes back has to mean what the example says.

/// `description` is whole but for the example of telegram `index`, which becomes the first good
/// one.
void CheckExamples(const std::vector<config::YamlNode>& examples, Description& description,
                   std::size_t index, config::Problems& problems);

}  // namespace baudgate::protocols::telegram
