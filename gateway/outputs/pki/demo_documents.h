// The two documents of DDS Security for `baudgate certs dds`: what is protected, and who may do
// what. Source: DDS Security 1.1, 9.4.1.2 and 9.4.1.3.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/time.h"

namespace baudgate::pki {

enum class Part {
  publish,    ///< a gateway: publish all but requests to write, which it subscribes
  subscribe,  ///< baudgate/*, and publish nothing
  write,      ///< the same, and publish baudgate/write
};

/// Everything encrypted, for the domains 0 to 230; of topics baudgate/* alone.
std::string Governance();
/// `name` is the CN of the identity.
std::string Permissions(const std::string& name, Part part, WallTime from, WallTime until);

}  // namespace baudgate::pki
