// A configuration of one device out of a profile and a few words of the command line, checked by
// the loader like any file: for `simulate` and `decode`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "gateway/base/result.h"

namespace baudgate {

struct OneDevice {
  std::string protocol;  ///< empty: the one whose profile it is
  std::string profile;   ///< empty: no points
  std::string address;
  std::string serial;            ///< empty: the protocol's default
  std::vector<std::string> set;  ///< "key=value"
};

/// The error lists every problem that the loader found, a line each.
Result<config::Config> MakeOneDevice(const OneDevice& wanted, const config::Catalog& catalog);

}  // namespace baudgate
