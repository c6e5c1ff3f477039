// The loop of the DDS process: packets from the daemon's socket to
// gateway/outputs/dds/link/link_server.h, answers back, and a sign of life to systemd.
// DenyCalls and LimitMemory confine the process before.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>

#include "gateway/base/result.h"
#include "gateway/outputs/dds/link/link_server.h"
#include "gateway/outputs/dds/link/packet_socket.h"

namespace baudgate::dds {

// What the DDS process gives up at its start, before any other thread and any call of the library:
// a datagram that takes it over must not get far. Under systemd its unit does the same and more.

/// A sanitizer needs the address space and the calls that are taken away here.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// SIGTERM when `parent` dies. False: it is dead already.
bool EndWith(pid_t parent);

/// Address space in bytes; no core files.
Status LimitMemory(std::uint64_t bytes);

/// From now on: no new programs, no tracing of others, no signals to others, no mounts, no local
/// sockets, no new namespaces, no kernel modules, nor what else exploits like. Such calls fail with
/// EPERM.
Status DenyCalls();

enum class ServeEnd {
  closed,   ///< the daemon is gone
  ended,    ///< in order
  stopped,  ///< `stop` became readable
};

/// Wakes the loop from any thread.
class WakeUp {
 public:
  WakeUp();
  void Ring() const;
  void Clear() const;
  int descriptor() const { return event_.get(); }

 private:
  Descriptor event_;
};

/// Serves until the link ends. Then subscribers are told the end of all points. The error says what
/// was wrong with the link; the daemon begins anew, so no end is told. `alive` is called at least
/// once a second, by the thread that reads the link; an error of it ends the link. `wake` rings
/// when the server has a request.
Result<ServeEnd> Serve(const Descriptor& link, LinkServer& server, const WakeUp& wake, int stop,
                       const std::function<Status()>& alive);

}  // namespace baudgate::dds
