// The loop of the DDS process: packets from the daemon's socket to
// gateway/outputs/dds/link/link_server.h, answers back, and a sign of life to systemd.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "gateway/base/result.h"
#include "gateway/outputs/dds/link/link_server.h"
#include "gateway/outputs/dds/link/packet_socket.h"

namespace baudgate::dds {

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
