// Which requests are let in before any login: by the client's address, and by the Origin and Host
// that a browser sends. A browser inside the network must not be led by a page from outside
// (DNS rebinding), nor by another port of the same machine. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/model/web.h"
#include "gateway/outputs/web/request.h"

namespace baudgate::web {

/// Why not; empty: it may.
std::optional<Response> Refusal(const config::Web& web, const Request& request);

bool IsLoopbackPeer(const std::string& peer);
/// With an empty list everybody.
bool IsAllowed(const config::Web& web, const std::string& peer);

/// Alarms may be acknowledged: in the configuration, and on a way that cannot be listened to. That
/// is this machine, or TLS up to a proxy that is named in `allow` or stands here.
bool MayAcknowledge(const config::Web& web, const Request& request);

/// A proxy that may say so has got the request by TLS.
bool CameByTls(const config::Web& web, const Request& request);

}  // namespace baudgate::web
