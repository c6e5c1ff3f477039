// The configuration of one port, made of words of the command line and read as a file would be.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "gateway/base/result.h"

namespace baudgate {

/// `text` as it stands in YAML, in quotes.
std::string YamlText(const std::string& text);

/// "/dev/serial/by-id/usb-x" → "usb-x": what a gateway or a line of that port is called.
std::string NameOfPort(const std::string& port);

/// The error lists all that is wrong, a line each.
Result<config::Config> PortConfig(const std::string& yaml, const config::Catalog& catalog);

}  // namespace baudgate
