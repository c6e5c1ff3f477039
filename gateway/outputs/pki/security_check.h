// Whether the files of DDS Security fit together and are valid now: said before the DDS library
// gets them, because it only says that there is no participant. Files come from `dds: { security: …
// }`; used by `baudgate check` and by gateway/outputs/dds/fast/participant.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

struct Finding {
  std::string key;       ///< of the configuration: "identity"
  std::string sentence;  ///< names the file and what to do; never a secret
  bool warning = false;  ///< they can be used nevertheless
};

struct SecurityReport {
  std::vector<Finding> findings;
  std::string subject;             ///< of the identity: "CN=baudgate"
  WallTime valid_until{};          ///< of the identity
  bool messages_protected = true;  ///< the governance protects whole RTPS messages
  std::string password;            ///< of the key; not to be shown

  /// The first that is no warning: "identity: …"; empty: all is well.
  std::string FirstError() const;
};

SecurityReport CheckSecurity(const config::DdsSecurity& security, WallTime now);

}  // namespace baudgate::pki
