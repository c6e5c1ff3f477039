// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/descriptors.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>

#include "gateway/lines/serial_server/server.h"

namespace baudgate::daemon {

namespace {

// The numbers of files contain a reserve, because a reload opens a new port before it closes the
// old port. A serial port needs more files, because it has a loop of its own.
constexpr std::size_t kForGateway = 64;  // control socket and its clients, log, recordings
constexpr std::size_t kForSerialPort = 8;
constexpr std::size_t kForNetworkPort = 2;
constexpr std::size_t kForPortServer = serial_server::Server::kMostClients + 2;
constexpr std::size_t kPartForViewers = 8;

std::size_t RoomForClients(const outputs::DescriptorNeeds& needs, std::size_t limit) {
  const std::size_t kept = needs.others + ViewerShare(needs, limit);
  return limit > kept ? std::min(limit - kept, needs.clients) : 1;
}

}  // namespace

outputs::DescriptorNeeds DescriptorNeedsOf(const config::Config& config,
                                           const OutputRows& outputs) {
  outputs::DescriptorNeeds needs;
  needs.others = kForGateway;
  for (const config::Line& line : config.lines) {
    needs.others += line.is_network() ? kForNetworkPort : kForSerialPort;
    if (line.server() != nullptr) needs.others += kForPortServer;
  }
  for (const OutputRow& output : outputs) {
    if (output.descriptors) needs += output.descriptors(config);
  }
  return needs;
}

std::size_t RaiseDescriptorLimit(std::size_t needed) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return needed;
  if (limit.rlim_cur < needed) {
    rlimit raised = limit;
    raised.rlim_cur = std::min<rlim_t>(needed, limit.rlim_max);
    if (::setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  }
  return limit.rlim_cur;
}

double ClientShare(const outputs::DescriptorNeeds& needs, std::size_t limit) {
  if (limit >= needs.all() || needs.clients == 0) return 1;
  return static_cast<double>(RoomForClients(needs, limit)) / static_cast<double>(needs.clients);
}

std::size_t ViewerShare(const outputs::DescriptorNeeds& needs, std::size_t limit) {
  return limit >= needs.all() ? needs.viewers : std::min(needs.viewers, limit / kPartForViewers);
}

std::string ExplainClientShare(const outputs::DescriptorNeeds& needs, std::size_t limit) {
  return fmt::format(
      "at most {} clients can connect, not {}, so each max_clients is lowered: the process may "
      "open {} files, and needs {} of them for ports and sockets. Raise LimitNOFILE of the service "
      "(ulimit -Hn) to {}, or lower max_clients",
      RoomForClients(needs, limit), needs.clients, limit, needs.others + ViewerShare(needs, limit),
      needs.all());
}

OpenFiles::OpenFiles() {
  const MutexLock lock(mutex_);
  folder_.reset(::opendir("/proc/self/fd"));
}

OpenFiles::Count OpenFiles::Now() {
  Count count;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    count.limit = limit.rlim_cur;
  }
  const MutexLock lock(mutex_);
  if (!folder_) return count;
  ::rewinddir(folder_.get());
  while (const dirent* const one = ::readdir(folder_.get())) {
    if (one->d_name[0] != '.') ++count.open;
  }
  return count;
}

}  // namespace baudgate::daemon
