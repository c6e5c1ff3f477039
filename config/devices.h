// One device of a line: its own keys, over those of its profile, over what its line and protocol
// say. YAML nodes come from config/lines.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/lines.h"

namespace baudgate::config {

/// The protocol that a `protocol:` names; null and a problem when it is not installed.
const Protocol* ReadProtocol(const YamlNode& node, LoadContext& context);

/// `line_protocol` is null when the line's own could not be found; `line_options` are those of
/// scope line that the line gives.
Device ReadDevice(const YamlNode& node, const Line& line, const Options& line_options,
                  const Protocol* line_protocol, LoadContext& context);

}  // namespace baudgate::config
