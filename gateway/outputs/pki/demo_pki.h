// A folder of everything that DDS Security needs to be tried, or to run a small plant:
//
//   DIR/ca/ca.pem key.pem                       the authority; its key belongs nowhere else
//   DIR/NAME/ca.pem identity.pem key.pem governance.p7s permissions.p7s       of a gateway
//   DIR/subscriber-1/…                          the same five of a subscriber
//   DIR/writer-1/…                              of a subscriber who may write
//
// Written by `baudgate certs dds`.
//
// MakeAuthority, IssueIdentity and SignDocument are the authority; Governance and Permissions are
// the two documents.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

// An authority for DDS Security as `baudgate certs dds` makes it: issues identities, signs
// documents.

/// Certificates, keys and documents, each as the text of a file.
struct Issued {
  std::string certificate;
  std::string key;
};

/// As `openssl smime -sign -text` does.
Result<std::string> SignDocument(const Issued& authority, const std::string& xml);

// The two documents of DDS Security for `baudgate certs dds`: what is protected, and who may do
// what. Source: DDS Security 1.1, 9.4.1.2 and 9.4.1.3.
enum class Part {
  publish,    ///< a gateway: publish all but requests to write, which it subscribes
  subscribe,  ///< baudgate/*, and publish nothing
  write,      ///< the same, and publish baudgate/write
};

/// Everything encrypted, for the domains 0 to 230; of topics baudgate/* alone.
std::string Governance();
/// `name` is the CN of the identity.
std::string Permissions(const std::string& name, Part part, WallTime from, WallTime until);

inline constexpr Duration kDemoValidity = 5 * 365 * 24h;

struct DemoPkiOptions {
  std::string directory;
  std::vector<std::string> gateways;  ///< names
  int subscribers = 0;                ///< numbered on from those that are there; may subscribe only
  int writers = 0;                    ///< the same; may publish baudgate/write as well
  Duration validity = kDemoValidity;  ///< of identities and permissions; the authority's at least
};

/// The folders that were made, in order. An authority that is there already is used; nothing is
/// ever written over. Keys can be read by their owner alone.
Result<std::vector<std::string>> WriteDemoPki(const DemoPkiOptions& options, WallTime now);

}  // namespace baudgate::pki
