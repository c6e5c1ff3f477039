// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/live/dds_programs.h"

#include <poll.h>
#include <sys/mman.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "config/loader.h"
#include "config/model/network.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/log.h"
#include "gateway/outputs/dds/discovery/announcement_relay.h"
#include "gateway/outputs/dds/link/child_process.h"
#include "gateway/tools/terminal/command_end.h"

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

namespace {

/// One profile a line.
std::string PointsOfProfiles(const config::Catalog& catalog) {
  std::string text;
  for (const config::ProfileFile& file : catalog.Profiles()) {
    const Protocol* protocol = catalog.FindProtocol(file.protocol);
    if (protocol == nullptr) continue;
    const auto loaded = config::LoadProfile(file.path.string(), *protocol, catalog);
    for (const config::Point& point : loaded.profile.points) {
      text += (point.access == config::Access::write ? "-" : "") + point.name + " ";
    }
    text += "\n";
  }
  return text;
}

/// A file in memory that the program gets, too; empty: it cannot be had, and names are the order.
std::string FileOf(const std::string& text) {
  const int file = ::memfd_create("point-order", 0);
  if (file < 0 || ::write(file, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    return {};
  }
  return "/proc/self/fd/" + std::to_string(file);
}

}  // namespace

int RunWatch(const std::vector<std::string>& words, const config::Catalog& catalog,
             std::ostream& err) {
  const auto program = dds::FindProgram("baudgate-dds");
  if (!program) {
    err << "watch: " << program.error() << "; install it\n";
    return kExitCanNot;
  }
  std::vector<std::string> all{"baudgate", "watch"};  // by this name it speaks of itself
  all.insert(all.end(), words.begin(), words.end());
  if (const std::string order = FileOf(PointsOfProfiles(catalog)); !order.empty()) {
    all.insert(all.end(), {"--point-order", order});
  }
  std::vector<char*> pointers;
  for (std::string& word : all) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(program->c_str(), pointers.data());
  err << "watch: " << *program << ": " << std::strerror(errno) << "\n";
  return kExitCanNot;
}

}  // namespace baudgate
