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

}  // namespace baudgate::protocols::telegram
