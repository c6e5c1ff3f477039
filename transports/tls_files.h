// `ReadTls` reads and checks the files of one end of TLS connections (config::TlsFiles): its
// certificate, its key, and the authorities that it trusts.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/network.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::tls {

/// The texts of the files (PEM).
struct TlsTexts {
  std::string certificate{};  ///< with the certificates of intermediate authorities
  std::string key{};
  std::string authorities{};
  WallTime until{};          ///< end of the certificate that ends first, of all that were read
  std::string ends_first{};  ///< file with this certificate

  bool on() const { return !certificate.empty(); }
  bool operator==(const TlsTexts&) const = default;
};

/// Reads the files. An error names the file and the remedy: it cannot be read, is not PEM, the key
/// belongs to another certificate, or other users can read or change the key. A certificate that
/// has ended is no error, because a gateway must start without its clock being right.
Result<TlsTexts> ReadTls(const config::TlsFiles& files);

/// Returns a warning if a certificate has ended or ends within 30 days: "the certificate F ends on
/// 2027-01-01; renew it"; empty: none does.
std::string EndsSoon(const TlsTexts& texts, WallTime now);

/// Returns the DNS names and IP addresses (subjectAltName) of the first certificate in a PEM file,
/// such as "gateway.example" and "10.0.0.7". Empty: the file cannot be read, or has no certificate
/// with names.
std::vector<std::string> NamesIn(const std::string& certificate);

}  // namespace baudgate::tls
