// Values of the options that protocols declare: from the words of the user or of the declaration
// itself to what a protocol is given. Specs come from protocols/protocol.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/options.h"
#include "gateway/base/result.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// One value as the user writes it ("true", "250ms", "a,b"), checked against its declaration. The
/// error never quotes a secret. Serves YAML, fallbacks and `--set` alike.
Result<OptionValue> ParseOption(const protocols::OptionSpec& spec, std::string_view text);

/// Every option that the protocol declares, at its fallback.
Options DefaultOptions(const protocols::Protocol& protocol);

/// Sets in `target` what `given` has.
void Override(Options& target, const Options& given);

}  // namespace baudgate::config
