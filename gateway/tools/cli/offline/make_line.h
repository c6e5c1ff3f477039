// A line of devices that stands in no file: profiles and a few words of the command line, checked
// as a file would be. For `simulate`, `decode` and `demo`.
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
  std::string protocol = {};  ///< empty: the one whose profile the first device has
  std::string serial = {};    ///< "9600 7E1"; empty: the protocol's default
  std::vector<WantedDevice> devices = {};
};

/// The protocol whose profile this is, by its name.
Result<std::string> ProtocolOfProfile(const std::string& profile, const config::Catalog& catalog);

/// Every option of every device is present. The error lists all that is wrong, a line each.
Result<config::Line> MakeLine(const WantedLine& wanted, const config::Catalog& catalog);

}  // namespace baudgate::tools
