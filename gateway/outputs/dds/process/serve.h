// `Serve` is the main loop of baudgate-dds: it passes packets from the gateway's socket to
// gateway/outputs/dds/link/link_server.h, sends answers back, and reports to systemd that the
// process is alive. DenyCalls and LimitMemory restrict the process before.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>

#include "gateway/base/result.h"
#include "gateway/outputs/dds/link/link_server.h"
#include "gateway/outputs/dds/link/packet_socket.h"

namespace baudgate::dds {

// The following functions restrict baudgate-dds at its start, before any other thread and any call
// of the DDS library, so that a datagram that takes over the process cannot do much. The systemd
// unit has the same restrictions and more.

/// True in builds with a sanitizer, which needs the address space and the calls that are denied
/// here.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// Lets the kernel send SIGTERM to this process when `parent` ends. False: `parent` has ended
/// already.
bool EndWith(pid_t parent);

/// Limits the address space to `bytes`, and disables core files.
Status LimitMemory(std::uint64_t bytes);

/// Installs a seccomp filter for the rest of the process: no new programs, no tracing of other
/// processes, no signals to them, no mounts, no local sockets, no new namespaces, no kernel
/// modules, and no other calls that exploits often use. A denied call fails with EPERM.
Status DenyCalls();

enum class ServeEnd {
  closed,   ///< the gateway has closed the link
  ended,    ///< the gateway has ended the link in order
  stopped,  ///< `stop` became readable
};

/// Wakes the loop of Serve. Any thread may call Ring.
class WakeUp {
 public:
  WakeUp();
  void Ring() const;
  void Clear() const;
  int descriptor() const { return event_.get(); }

 private:
  Descriptor event_;
};

/// Serves until the link ends, then publishes that all points are gone. An error is about a fault
/// of the link; the gateway then restarts the process, so nothing is published. `alive` is called
/// at least once a second, on the thread that reads the link; an error of `alive` ends the link.
/// `wake` must ring when the server has a write request.
Result<ServeEnd> Serve(const Descriptor& link, LinkServer& server, const WakeUp& wake, int stop,
                       const std::function<Status()>& alive);

}  // namespace baudgate::dds
