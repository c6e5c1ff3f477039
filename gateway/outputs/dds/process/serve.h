// `Serve` is the main loop of baudgate-dds: it passes packets between the gateway's socket and
// LinkServer. DenyCalls and LimitMemory restrict the process before.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>

#include "gateway/base/result.h"
#include "gateway/outputs/dds/link/link_server.h"
#include "gateway/outputs/dds/link/packet_socket.h"

namespace baudgate::dds {

/// A sanitizer needs the address space and the calls that are denied here.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// Requests SIGTERM from the kernel when `parent` ends. False: `parent` has ended already.
bool EndWith(pid_t parent);

/// Limits the address space to `bytes`, and disables core files.
Status LimitMemory(std::uint64_t bytes);

/// Denies calls that exploits use, by seccomp: new programs, tracing, signals, mounts, local
/// sockets, namespaces, kernel modules and others. They fail with EPERM.
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

/// Serves until the link ends, then publishes all points as not connected. An error is a fault of
/// the link; the gateway restarts the process, so nothing is published. `alive` is called at least
/// once a second; its error ends the link. Write requests must ring `wake`.
Result<ServeEnd> Serve(const Descriptor& link, LinkServer& server, const WakeUp& wake, int stop,
                       const std::function<Status()>& alive);

}  // namespace baudgate::dds
