// `WriteDemoPki` makes a folder with everything that DDS Security needs for a trial or a small
// plant:
//
//   DIR/ca/ca.pem key.pem                       the authority; its key must stay in this folder
//   DIR/NAME/ca.pem identity.pem key.pem governance.p7s permissions.p7s       of a gateway
//   DIR/subscriber-1/…                          the same five files of a subscriber
//   DIR/writer-1/…                              the same of a subscriber that may write
//
// `baudgate certs dds` calls it.
//
// SignDocument signs as the authority; Governance and Permissions make the two documents.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

/// Certificate and private key, as the texts of PEM files.
struct Issued {
  std::string certificate;
  std::string key;
};

/// As `openssl smime -sign -text` does. Returns the text of a .p7s file.
Result<std::string> SignDocument(const Issued& authority, const std::string& xml);

// `Part` says what an identity may do. Governance and Permissions return the two documents of DDS
// Security: what is protected, and who may do what. Source: DDS Security 1.1, 9.4.1.2 and 9.4.1.3.
enum class Part {
  publish,    ///< a gateway: publishes all topics but write requests, which it subscribes
  subscribe,  ///< a subscriber: subscribes baudgate/*, publishes nothing
  write,      ///< a subscriber that also publishes baudgate/write
};

/// Everything is encrypted, in the domains 0 to 230; the only topics are baudgate/*.
std::string Governance();
/// `name` is the CN of the identity.
std::string Permissions(const std::string& name, Part part, WallTime from, WallTime until);

inline constexpr Duration kDemoValidity = 5 * 365 * 24h;

struct DemoPkiOptions {
  std::string directory;
  std::vector<std::string> gateways;  ///< names
  int subscribers = 0;                ///< may subscribe only; numbered after those that exist
  int writers = 0;  ///< may publish baudgate/write as well; numbered after those that exist
  /// Validity of identities and permissions; a new authority is valid longer.
  Duration validity = kDemoValidity;
};

/// Returns the folders that were made, in order. An existing authority is used, and no file is ever
/// overwritten. Only the owner can read the keys.
Result<std::vector<std::string>> WriteDemoPki(const DemoPkiOptions& options, WallTime now);

}  // namespace baudgate::pki
