// Parses values of the options that protocols declare, from the user's text or from the defaults.
// The declarations (OptionSpec) come from protocols/options.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/options.h"
#include "gateway/base/result.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// Parses one value as the user writes it ("true", "250ms", "a,b") and checks it against its
/// declaration. The error never contains a secret. Used for YAML, defaults and `--set`.
Result<OptionValue> ParseOption(const protocols::OptionSpec& spec, std::string_view text);

Options DefaultOptions(const protocols::Protocol& protocol);

/// Copies all options of `given` to `target`. In an option of the kind Pairs, words that only
/// `target` has are kept.
void Override(Options& target, const Options& given);

}  // namespace baudgate::config
