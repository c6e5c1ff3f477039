// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/live/discovery_server.h"

#include <poll.h>
#include <systemd/sd-daemon.h>

#include "config/model/discovery_server.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/log.h"
#include "gateway/outputs/dds/discovery/relay_socket.h"
#include "gateway/tools/terminal/stop_signals.h"

namespace baudgate {
namespace {

constexpr int kSignOfLife = 1000;  // ms

void TellSystemd(std::size_t participants) {
  sd_notifyf(0, "WATCHDOG=1\nSTATUS=knows %zu participants", participants);
}

}  // namespace

int RunDiscoveryServer(const std::string& listen, std::ostream& err) {
  const auto at = config::ParseDiscoveryServer(listen);
  if (!at) {
    err << "discovery-server: --listen: " << at.error() << '\n';
    return kExitUsage;
  }
  const StopSignals stop;
  auto socket = dds::RelaySocket::Open(*at);
  if (!socket) {
    err << "discovery-server: " << socket.error() << '\n';
    return kExitCanNot;
  }
  log::Info("discovery server: introduces DDS participants that announce themselves at {}:{}",
            at->host, at->port);
  sd_notify(0, "READY=1");
  dds::AnnouncementRelay relay;
  Instant next_sign{};
  pollfd waited[] = {{stop.descriptor(), POLLIN, 0}, {socket->descriptor(), POLLIN, 0}};
  while ((waited[0].revents & POLLIN) == 0) {
    ::poll(waited, 2, kSignOfLife);
    socket->Take(relay);
    const Instant now = ReadClocks().instant;
    if (now < next_sign) continue;
    next_sign = now + 1s;
    TellSystemd(relay.participants());
  }
  sd_notify(0, "STOPPING=1");
  return kExitDone;
}

}  // namespace baudgate
