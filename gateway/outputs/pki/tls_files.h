// `TlsFiles` are the certificate and the key of a server that speaks TLS. `ReadTls` reads and
// checks the files, and `WriteServerFiles` makes them for `baudgate certs web`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

/// Paths. `client_ca` empty: clients need no certificate.
struct TlsFiles {
  std::string certificate{};
  std::string key{};
  std::string client_ca{};
  bool operator==(const TlsFiles&) const = default;
};

/// The texts of the files (PEM). Equal texts need no new start of the server.
struct TlsTexts {
  std::string certificate{};  ///< with the certificates of intermediate authorities
  std::string key{};
  std::string client_ca{};
  WallTime until{};  ///< end of the certificate that ends first

  bool on() const { return !certificate.empty(); }
  bool operator==(const TlsTexts&) const = default;
};

/// Reads the files. An error names the file and the remedy: it cannot be read, is not PEM, the key
/// belongs to another certificate, or other users can read or change the key. A certificate that
/// has ended is no error, because a gateway must start without its clock being right.
Result<TlsTexts> ReadTls(const TlsFiles& files);

/// Returns a warning if the certificate has ended or ends within 30 days: "the certificate F ends
/// on 2027-01-01; renew it"; empty: it does not.
std::string EndsSoon(const std::string& file, WallTime until, WallTime now);

inline constexpr Duration kServerValidity = 730 * 24h;

/// Returns the host names and addresses of a certificate (subjectAltName), as WriteServerFiles
/// takes them; empty: the file has none or cannot be read.
std::vector<std::string> NamesIn(const std::string& certificate);

/// Writes DIR/ca.key and DIR/ca.pem, unless they exist, and DIR/gateway.key and DIR/gateway.pem,
/// which are renewed if they exist. `names`: the host names and addresses in the certificate; the
/// first is its CN. Returns the files that were written. An error: a name is none, or the key of
/// the authority is missing or belongs to another certificate.
Result<std::vector<std::string>> WriteServerFiles(const std::string& folder,
                                                  const std::vector<std::string>& names,
                                                  WallTime now);

}  // namespace baudgate::pki
