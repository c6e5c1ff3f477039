// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/security_problems.h"

#include "gateway/outputs/pki/security_check.h"

namespace baudgate {

std::string CheckDdsSecurity(const config::Config& config, WallTime now,
                             std::vector<config::Problem>& problems) {
  const config::DdsSecurity& security = config.dds.security;
  if (!config.dds.enabled || !security.on()) return {};
  const pki::SecurityReport report = pki::CheckSecurity(security, now);
  for (const pki::Finding& finding : report.findings) {
    problems.push_back({security.keys.MarkOf(finding.key), finding.key + ": " + finding.sentence,
                        finding.warning});
  }
  return report.subject + ", until " + FormatWallTime(report.valid_until).substr(0, 10) +
         (report.messages_protected ? "" : "; the governance leaves messages unprotected");
}

}  // namespace baudgate
