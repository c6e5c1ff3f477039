// `dds: { security: … }`: a folder, or the files one by one. YAML nodes come from config/outputs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/lines.h"
#include "config/model/dds_security.h"

namespace baudgate::config {

/// A path for the process that speaks DDS: relative to the configuration, it comes out absolute.
/// Empty, and a problem, when it can not be one. The file is not looked at: what is wrong with it
/// is a state of the gateway, and for `baudgate check` to say.
std::string DdsPath(const std::string& path, const std::string& key, const Mark& mark,
                    LoadContext& context);

DdsSecurity ReadDdsSecurity(const YamlNode& node, LoadContext& context);

}  // namespace baudgate::config
