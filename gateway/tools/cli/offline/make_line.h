// `MakeLine` makes a line of a configuration from words of the command line, and checks it like a
// configuration file.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/line.h"
#include "gateway/base/result.h"

namespace baudgate::tools {

struct WantedDevice {
  std::string name = "device";
  std::string profile = {};  ///< name in the catalog, or path of a file; empty: no points
  std::string address = {};
  std::vector<std::string> set = {};  ///< options of the protocol, "key=value"
};

struct WantedLine {
  std::string name = "line";
  std::string port = "/dev/null";
  std::string protocol = {};  ///< empty: the protocol of the first device's profile
  std::string serial = {};    ///< serial settings: "9600 7E1"; empty: the protocol's default
  std::vector<WantedDevice> devices = {};
};

Result<std::string> ProtocolOfProfile(const std::string& profile, const config::Catalog& catalog);

/// Sets each option of each device, if necessary to its default. The error contains all problems,
/// one on each line.
Result<config::Line> MakeLine(const WantedLine& wanted, const config::Catalog& catalog);

}  // namespace baudgate::tools
