// A request as libmicrohttpd has it, as a plain value.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <microhttpd.h>

#include <string>

#include "gateway/outputs/web/request.h"

namespace baudgate::web {

/// Without its content.
Request RequestOf(MHD_Connection* connection, const char* url, const char* method);

int SocketOf(MHD_Connection* connection);
/// "10.0.0.7"; empty: not known.
std::string PeerOf(MHD_Connection* connection);

/// "%41" is A. A zero stays as it is written: for the library a text ends there.
std::size_t Unescape(void*, MHD_Connection*, char* text);

}  // namespace baudgate::web
