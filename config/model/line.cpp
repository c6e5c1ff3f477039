// SPDX-License-Identifier: Apache-2.0
#include "config/model/line.h"

#include "gateway/base/text.h"

namespace baudgate::config {

std::string PortServer::Address() const { return HostAndPort(at.host, at.port); }

}  // namespace baudgate::config
