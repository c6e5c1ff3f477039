// The options that protocols declare: from the words of the user, of a profile or of the
// declaration itself to typed values. Specs come from protocols/protocol.h; values go to
// config::Options.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/options.h"
#include "config/yaml/yaml_reader.h"
#include "gateway/base/result.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// One value as the user writes it ("true", "250ms", "a,b"), checked against its declaration. The
/// error never quotes a secret. Serves YAML, fallbacks and `decode --set` alike.
Result<OptionValue> ParseOption(const OptionSpec& spec, std::string_view text);

/// The options of that scope that stand in `map`. Those of the other scope are refused, and the
/// message says where they belong.
Options ReadOptions(MapReader& map, const Protocol& protocol, OptionSpec::Scope scope);

/// Every option that the protocol declares, at its fallback.
Options DefaultOptions(const Protocol& protocol);

/// Sets in `target` what `given` has.
void Override(Options& target, const Options& given);

}  // namespace baudgate::config
