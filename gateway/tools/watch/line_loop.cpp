// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/line_loop.h"

#include <poll.h>

#include <algorithm>

namespace baudgate {
namespace {

int MillisecondsUntil(Instant then) {
  const Duration left = std::max<Duration>(then - ReadClocks().instant, Duration::zero());
  return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count());
}

}  // namespace

void RunLineLoop(const LineLoop& loop, Listening& listening, std::ostream& out, std::ostream& err) {
  const Instant end = loop.seconds ? ReadClocks().instant + *loop.seconds : Instant::max();
  for (Instant now = ReadClocks().instant; now < end; now = ReadClocks().instant) {
    if (const auto told = listening.Look(now)) err << "watch: " << *told << std::endl;
    pollfd waited[] = {{loop.signals.descriptor(), POLLIN, 0}, {loop.mailbox, POLLIN, 0}};
    ::poll(waited, 2, MillisecondsUntil(std::min(end, listening.next_look())));
    loop.print();
    out.flush();
    if ((waited[0].revents & POLLIN) != 0 || !out) return;
  }
}

}  // namespace baudgate
