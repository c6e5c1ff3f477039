// `CheckSecurity` checks whether the files of DDS Security fit together and are valid now. The DDS
// library itself only reports that there is no participant. The files are named in `dds: {
// security: … }`; `baudgate check` and gateway/outputs/dds/fast/participant.h call the check.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

struct Finding {
  std::string key;       ///< the key in the configuration, e.g. "identity"
  std::string sentence;  ///< names the file and the remedy; contains no secret
  bool warning = false;  ///< true: the files can be used nevertheless
};

struct SecurityReport {
  std::vector<Finding> findings;
  std::string subject;             ///< subject of the identity, e.g. "CN=baudgate"
  WallTime valid_until{};          ///< end of the identity's validity
  bool messages_protected = true;  ///< the governance protects whole RTPS messages
  std::string password;            ///< password of the key; not to be shown

  /// Returns the first finding that is no warning, e.g. "identity: …"; empty: there is none.
  std::string FirstError() const;
};

SecurityReport CheckSecurity(const config::DdsSecurity& security, WallTime now);

}  // namespace baudgate::pki
