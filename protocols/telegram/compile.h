// `Compile` reads the YAML of a description into telegrams. It reports all errors at once, each
// with line and column, so no error is left to be found later, on the line. `CheckExamples` checks
// the examples of a description.
#pragma once

#include <memory>
#include <vector>

#include "config/yaml/yaml_reader.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

/// Reads a description. Errors are reported to `problems`; the result then has no telegrams.
std::shared_ptr<const config::Description> Compile(const config::YamlNode& telegrams,
                                                   config::Problems& problems);

/// Checks the examples of telegram `index`, and stores the good examples in the telegram. The
/// pattern must give the sent bytes, and the received bytes must have the values that the example
/// states. All telegrams of `description` must have been read.
void CheckExamples(const std::vector<config::YamlNode>& examples, Description& description,
                   std::size_t index, config::Problems& problems);

}  // namespace baudgate::protocols::telegram
