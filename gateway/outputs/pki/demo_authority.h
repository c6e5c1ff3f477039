// An authority for DDS Security as `baudgate certs dds` makes it: issues identities, signs
// documents.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

/// Certificates, keys and documents, each as the text of a file.
struct Issued {
  std::string certificate;
  std::string key;
};
struct Validity {
  WallTime from{};
  WallTime until{};
};

/// EC prime256v1, as DDS Security 1.1 (9.3.1) wants it. `name` is the CN.
Result<Issued> MakeAuthority(const std::string& name, const Validity& validity);
Result<Issued> IssueIdentity(const Issued& authority, const std::string& name,
                             const Validity& validity);
/// As `openssl smime -sign -text` does.
Result<std::string> SignDocument(const Issued& authority, const std::string& xml);

}  // namespace baudgate::pki
