// SPDX-License-Identifier: Apache-2.0
#include "config/model/web.h"

#include "gateway/base/text.h"

namespace baudgate::config {

std::string Web::Place() const { return HostAndPort(listen.host, listen.port); }

}  // namespace baudgate::config
