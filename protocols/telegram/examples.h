// The examples of a description, run: what is sent is built from the pattern byte by byte, and what
// comes back has to mean what the example says.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/yaml/yaml_reader.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

/// `description` is whole but for the example of telegram `index`, which becomes the first good
/// one.
void CheckExamples(const std::vector<config::YamlNode>& examples, Description& description,
                   std::size_t index, config::Problems& problems);

}  // namespace baudgate::protocols::telegram
