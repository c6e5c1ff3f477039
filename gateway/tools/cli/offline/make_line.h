// MakeLine makes a line from words of the command line, checked like a configuration file.
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
  std::string profile = {};  ///< a name in the catalog, or a path; empty: no points
  std::string address = {};
  std::vector<std::string> set = {};  ///< options of the protocol, "key=value"
};

struct WantedLine {
  std::string name = "line";
  std::string port = "/dev/null";
  std::string protocol = {};  ///< empty: the protocol that has the first device's profile
  std::string serial = {};    ///< "9600 7E1"; empty: the protocol's default
  std::vector<WantedDevice> devices = {};
};

Result<std::string> ProtocolOfProfile(const std::string& profile, const config::Catalog& catalog);

/// Every option of every device gets a value, if necessary its default. The error lists all
/// problems, one on each line.
Result<config::Line> MakeLine(const WantedLine& wanted, const config::Catalog& catalog);

}  // namespace baudgate::tools
