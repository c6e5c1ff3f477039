// `dds: { security: … }`: a folder, or the files one by one. YAML nodes come from config/outputs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/lines.h"
#include "config/model/dds_security.h"

namespace baudgate::config {

/// Paths come out absolute. The files are not looked at: what is wrong with them is a state of the
/// gateway, and for `baudgate check` to say.
DdsSecurity ReadDdsSecurity(const YamlNode& node, LoadContext& context);

}  // namespace baudgate::config
