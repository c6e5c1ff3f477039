// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/participant_security.h"

#include <fastdds/rtps/attributes/PropertyPolicy.h>

#include "gateway/outputs/pki/security_check.h"

namespace baudgate::dds {

Result<Secured> AddSecurity(const config::DdsSecurity& security, WallTime now,
                            eprosima::fastrtps::rtps::PropertyPolicy& properties) {
  if (!security.on()) return Secured::off;
  const pki::SecurityReport report = pki::CheckSecurity(security, now);
  if (const std::string error = report.FirstError(); !error.empty()) {
    return Error{"dds: security: " + error};
  }
  const auto add = [&properties](const std::string& name, const std::string& value) {
    properties.properties().emplace_back("dds.sec." + name, value);
  };
  const auto file = [](const std::string& path) { return "file://" + path; };
  add("auth.plugin", "builtin.PKI-DH");
  add("auth.builtin.PKI-DH.identity_ca", file(security.ca));
  add("auth.builtin.PKI-DH.identity_certificate", file(security.identity));
  add("auth.builtin.PKI-DH.private_key", file(security.key));
  if (!report.password.empty()) add("auth.builtin.PKI-DH.password", report.password);
  add("access.plugin", "builtin.Access-Permissions");
  add("access.builtin.Access-Permissions.permissions_ca", file(security.signer()));
  add("access.builtin.Access-Permissions.governance", file(security.governance));
  add("access.builtin.Access-Permissions.permissions", file(security.permissions));
  add("crypto.plugin", "builtin.AES-GCM-GMAC");
  return report.messages_protected ? Secured::demanded : Secured::allowed;
}

}  // namespace baudgate::dds
