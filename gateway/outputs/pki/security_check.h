// `CheckSecurity` checks whether the files of DDS Security (`dds: { security: … }`) fit together
// and are valid now, because the DDS library would only report that there is no participant.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

struct Finding {
  std::string key;       ///< key in the configuration, e.g. "identity"
  std::string sentence;  ///< contains the file and the remedy, but no secret
  bool warning = false;  ///< true: the files can be used nevertheless
};

struct SecurityReport {
  std::vector<Finding> findings;
  std::string subject;  ///< subject of the identity, e.g. "CN=baudgate"
  WallTime valid_until{};
  bool messages_protected = true;  ///< the governance protects whole RTPS messages
  std::string password;            ///< password of the key; must not be shown

  /// Returns the first finding that is not a warning, as "identity: …"; empty: there is no such
  /// finding.
  std::string FirstError() const;
};

SecurityReport CheckSecurity(const config::DdsSecurity& security, WallTime now);

}  // namespace baudgate::pki
