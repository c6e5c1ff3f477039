// `WriteDemoPki` creates a folder with all files that DDS Security needs for a trial or a small
// plant:
//
//   DIR/ca/ca.pem key.pem                       the authority; its key must stay in this folder
//   DIR/NAME/ca.pem identity.pem key.pem governance.p7s permissions.p7s       of a gateway
//   DIR/subscriber-1/…                          the same five files of a subscriber
//   DIR/writer-1/…                              the same for a subscriber that is allowed to write
//
// `baudgate certs dds` calls it.
//
// SignDocument signs as the authority; Governance and Permissions return the two documents.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

/// A certificate and its private key, as the texts of PEM files.
struct Issued {
  std::string certificate;
  std::string key;
};

/// The validity of certificates begins this time before now, because clocks differ, and because
/// Fast DDS reads the times of permissions as local times.
inline constexpr Duration kClocksDiffer = 24h;

struct Validity {
  WallTime from{};
  WallTime until{};
};

/// Creates an authority with an EC key on prime256v1, as DDS Security 1.1 (9.3.1) demands. `name`
/// is its CN.
Result<Issued> MakeAuthority(const std::string& name, const Validity& validity);
/// Issues a certificate for a TLS server, which can also show it as a client. `names`: its host
/// names and addresses (subjectAltName); the first is its CN.
Result<Issued> IssueServer(const Issued& authority, const std::vector<std::string>& names,
                           const Validity& validity);
/// Issues a certificate for a TLS client. `name` is its CN; `role` empty: the certificate contains
/// no role for Modbus (tls::kRoleExtension).
Result<Issued> IssueClient(const Issued& authority, const std::string& name,
                           const std::string& role, const Validity& validity);

/// Signs like `openssl smime -sign -text`. Returns the text of a .p7s file.
Result<std::string> SignDocument(const Issued& authority, const std::string& xml);

// `Part` is the role of an identity. Governance and Permissions return the two documents of DDS
// Security: the governance lists what is protected, the permissions list which topics an identity
// is allowed to use. Source: DDS Security 1.1, 9.4.1.2 and 9.4.1.3.
enum class Part {
  publish,    ///< a gateway: publishes all topics except write requests, which it subscribes
  subscribe,  ///< a subscriber: subscribes baudgate/*, publishes nothing
  write,      ///< a subscriber that also publishes baudgate/write
};

/// Returns a governance that encrypts everything, in the domains 0 to 230, and allows only the
/// topics baudgate/*.
std::string Governance();
/// Returns the permissions. `name` is the CN of the identity.
std::string Permissions(const std::string& name, Part part, WallTime from, WallTime until);

inline constexpr Duration kDemoValidity = 5 * 365 * 24h;

struct DemoPkiOptions {
  std::string directory;
  std::vector<std::string> gateways;
  /// Number of subscribers to create that can only subscribe. Their folders get the first free
  /// numbers.
  int subscribers = 0;
  /// Number of subscribers to create that can also publish baudgate/write. Their folders get the
  /// first free numbers.
  int writers = 0;
  /// Validity of identities and permissions; a new authority is valid longer.
  Duration validity = kDemoValidity;
};

/// Returns the folders that were created, in order. An existing authority is used again, and no
/// file is ever overwritten. Only the owner can read the keys.
Result<std::vector<std::string>> WriteDemoPki(const DemoPkiOptions& options, WallTime now);

}  // namespace baudgate::pki
