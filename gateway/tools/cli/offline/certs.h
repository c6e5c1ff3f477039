// `baudgate certs dds`: an authority, identities and signed documents for DDS Security, as files.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace baudgate {

struct CertsOptions {
  std::string directory;
  std::vector<std::string> gateways;  ///< names; with nothing asked for and no authority: baudgate
  std::optional<int> subscribers;     ///< likewise one
  int writers = 0;
};

/// Exit codes: 0 done, 2 a name that cannot be, 4 something is there already or cannot be
/// written.
int RunCerts(const CertsOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
