// `CheckSecurity` checks whether the files of DDS Security (`dds: { security: … }`) fit together
// and are valid now, because the DDS library only reports that there is no participant.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

struct Finding {
  std::string key;       ///< in the configuration, e.g. "identity"
  std::string sentence;  ///< names the file and the remedy; contains no secret
  bool warning = false;  ///< true: the files can be used nevertheless
};

struct SecurityReport {
  std::vector<Finding> findings;
  std::string subject;             ///< of the identity, e.g. "CN=baudgate"
  WallTime valid_until{};          ///< of the identity
  bool messages_protected = true;  ///< the governance protects whole RTPS messages
  std::string password;            ///< of the key; not to be shown

  /// The first finding that is no warning, as "identity: …"; empty: none.
  std::string FirstError() const;
};

SecurityReport CheckSecurity(const config::DdsSecurity& security, WallTime now);

}  // namespace baudgate::pki
