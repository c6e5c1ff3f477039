// An answer as libmicrohttpd sends it: with the headers that every answer has.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <microhttpd.h>

#include <atomic>
#include <memory>

#include "gateway/outputs/web/exchange.h"
#include "gateway/outputs/web/request.h"

namespace baudgate::web {

/// The bytes of all answers that are under way.
using BytesUnderWay = std::shared_ptr<std::atomic<std::size_t>>;

/// `last`: the connection ends behind it.
MHD_Result Send(MHD_Connection* connection, const Response& response,
                const std::shared_ptr<Exchange>& exchange, const BytesUnderWay& bytes, bool last);

}  // namespace baudgate::web
