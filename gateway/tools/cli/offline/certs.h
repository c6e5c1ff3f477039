// `baudgate certs dds`: writes an authority, identities and signed documents for DDS Security.
// `baudgate certs web`, `modbus`, `ports`: write an authority and certificates for TLS.
// CheckDdsSecurity checks these files for `baudgate check`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "config/model/problem.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

/// Checks the DDS Security files and adds their problems to `problems`. Returns a text for the
/// summary, such as "CN=baudgate, until 2031-11-21"; empty: DDS is off or runs without security.
std::string CheckDdsSecurity(const config::Config& config, WallTime now,
                             std::vector<config::Problem>& problems);

struct CertsOptions {
  std::string directory;
  /// Default, if no identity is requested and the folder contains no authority yet: "baudgate".
  std::vector<std::string> gateways;
  /// The number of subscribers. Empty: 0, or 1 if no identity is requested and the folder contains
  /// no authority yet.
  std::optional<int> subscribers;
  int writers = 0;
};

/// Exit codes: 0 done; 2 invalid name; 4 a file exists already or cannot be written, or no identity
/// is requested for an existing authority.
int RunCerts(const CertsOptions& options, std::ostream& out, std::ostream& err);

struct ServerCertsOptions {
  enum class Use : std::uint8_t { web, modbus, ports };
  Use use = Use::web;
  std::string directory;
  /// Host names and addresses of the gateway. Empty: those of the certificate that is renewed, else
  /// the name of this machine, localhost and 127.0.0.1.
  std::vector<std::string> names;
};

/// `baudgate certs web`, `certs modbus` and `certs ports`. Exit codes: 0 done; 4 a file cannot be
/// read or written.
int RunServerCerts(const ServerCertsOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
