// `baudgate certs dds`: an authority, identities and signed documents for DDS Security, as files.
// CheckDdsSecurity checks the files for `baudgate check`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "config/model/problem.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

// What `baudgate check` says of the files of DDS Security.

/// Adds to `problems`; gives a line for the summary: "CN=baudgate, until 2031-11-21". Empty: DDS is
/// off, or open to everybody.
std::string CheckDdsSecurity(const config::Config& config, WallTime now,
                             std::vector<config::Problem>& problems);

struct CertsOptions {
  std::string directory;
  std::vector<std::string> gateways;  ///< names; with nothing asked for and no authority: baudgate
  std::optional<int> subscribers;     ///< likewise one
  int writers = 0;
};

/// Exit codes: 0 done, 2 a name that cannot be, 4 something is there already or cannot be
/// written.
int RunCerts(const CertsOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
