// `Serve` is the main loop of baudgate-dds: it passes packets between the gateway's socket and
// gateway/outputs/dds/link/link_server.h, and reports to systemd that the process is alive.
// DenyCalls and LimitMemory restrict the process before the loop starts.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>

#include "gateway/base/result.h"
#include "gateway/outputs/dds/link/link_server.h"
#include "gateway/outputs/dds/link/packet_socket.h"

namespace baudgate::dds {

// These functions restrict baudgate-dds at its start, before it starts threads or calls the DDS
// library, so that a datagram that takes over the process can do little. The systemd unit contains
// the same restrictions and more.

/// True in builds with a sanitizer, which needs the address space and the calls that are denied
/// here.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// Requests that the kernel sends SIGTERM to this process when `parent` ends. False: `parent` has
/// ended already.
bool EndWith(pid_t parent);

/// Limits the address space to `bytes`, and disables core files.
Status LimitMemory(std::uint64_t bytes);

/// Denies new programs, tracing of other processes, signals to them, mounts, local sockets, new
/// namespaces, kernel modules and other calls that exploits often use, by seccomp. A denied call
/// fails with EPERM.
Status DenyCalls();

enum class ServeEnd {
  closed,   ///< the gateway has closed the link
  ended,    ///< the gateway has ended the link in order
  stopped,  ///< the descriptor `stop` became readable
};

/// WakeUp wakes the loop of Serve from any thread.
class WakeUp {
 public:
  WakeUp();
  void Ring() const;
  void Clear() const;
  int descriptor() const { return event_.get(); }

 private:
  Descriptor event_;
};

/// Serves until the link ends, then publishes all points as not connected. After an error, which is
/// a fault of the link or comes from `alive`, nothing is published, because the gateway restarts
/// the process. `alive` is called at least once a second, on the thread that reads the link. The
/// owner of `server` must ring `wake` when there is a write request.
Result<ServeEnd> Serve(const Descriptor& link, LinkServer& server, const WakeUp& wake, int stop,
                       const std::function<Status()>& alive);

}  // namespace baudgate::dds
