// `baudgate read --port …`: one look at a device, without a file and without a running gateway.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate {

struct ReadPortOptions {
  std::string port;  ///< /dev/…, or tcp://host:port
  std::string profile;
  std::string protocol;  ///< empty: the one whose profile it is
  std::string address;
  std::string serial;                ///< "9600 7E1"; empty: the protocol's
  std::vector<std::string> options;  ///< of the protocol, "key=value"
  std::string point;                 ///< empty: all
  bool json = false;
};

/// What `baudgate read` prints of a running gateway. Exit codes: 0 all was read; 1 the device did
/// not answer; 2 there is no such point; 3 bad words; 4 the port cannot be opened.
int RunReadPort(const ReadPortOptions& options, const config::Catalog& catalog, std::ostream& out,
                std::ostream& err);

}  // namespace baudgate
