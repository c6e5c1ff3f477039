// `Compile` reads the YAML of a description into telegrams. It reports all errors at once, each
// with line and column, so that no error appears when the line runs. `CheckExamples` checks the
// examples of a description.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "config/yaml/yaml_reader.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

/// Returns the description; it has no telegrams if there is an error.
std::shared_ptr<const config::Description> Compile(const config::YamlNode& telegrams,
                                                   config::Problems& problems);

/// Checks the examples of telegram `index`, and stores the good ones in it. The sent bytes must be
/// what the pattern gives; the received bytes must mean what the example states. The rest of
/// `description` must be complete.
void CheckExamples(const std::vector<config::YamlNode>& examples, Description& description,
                   std::size_t index, config::Problems& problems);

}  // namespace baudgate::protocols::telegram
