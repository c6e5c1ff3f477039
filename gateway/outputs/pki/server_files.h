// `WriteServerFiles` makes an authority and certificates for TLS: of the gateway, and of clients
// with a role. `baudgate certs` calls it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

inline constexpr Duration kServerValidity = 730 * 24h;

/// A client that gets a certificate. The files have its name.
struct ClientFiles {
  std::string name;
  std::string role{};  ///< role for Modbus; empty: none
};

/// Writes DIR/ca.key and DIR/ca.pem, unless they exist, DIR/gateway.key and DIR/gateway.pem, and
/// NAME.key and NAME.pem for each client. Keys and certificates other than those of the authority
/// are renewed if they exist. `names`: the host names and addresses of the gateway; the first is
/// the CN of its certificate. Returns the files that were written. An error: a name is none, or the
/// key of the authority is missing or belongs to another certificate.
Result<std::vector<std::string>> WriteServerFiles(const std::string& folder,
                                                  const std::vector<std::string>& names,
                                                  const std::vector<ClientFiles>& clients,
                                                  WallTime now);

}  // namespace baudgate::pki
