// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/connection_words.h"

#include <fmt/format.h>

#include <cstddef>

#include "gateway/status/words.h"

namespace baudgate::control {

std::string WhyEnded(const LineStatus& status, Instant since, bool in_use) {
  constexpr std::size_t kTwice = 2;
  constexpr std::size_t kThrice = 3;
  const ConnectionEnds& ends = status.ends;
  const std::size_t asked = ends.asked.Since(since);
  const std::size_t all = asked + ends.idle.Since(since);
  const auto mostly = [&](const RecentTimes& what) {
    const std::size_t times = what.Since(since);
    return times >= kTwice && 2 * times >= all;
  };
  if (mostly(ends.shut)) {
    return "the next one was closed at once: another client takes it: take that away, or raise the "
           "limit of connections";
  }
  if (mostly(ends.refused)) {
    return "the next one was refused: the server, its program or modem restarts or has no link: "
           "look at its power and its log";
  }
  if (mostly(ends.unreachable)) {
    return "no host answered for a while: look at the power of the server and at the network "
           "(cable, switch, radio)";
  }
  // By chance as many as there are requests under way.
  if (all >= kThrice &&
      static_cast<double>(asked) >= (status.use + 1) / 2 * static_cast<double>(all)) {
    return "with a request under way: the server fails at requests: look at its load, its log and "
           "its firmware";
  }
  if (ends.alike >= kThrice && ends.age > Duration()) {
    return fmt::format(
        "each after about {:.1f} s: the server limits the time of a connection, or another client "
        "takes it: raise these limits",
        Seconds(ends.age));
  }
  if (in_use) {
    return "another client takes it (take that away, or raise the limit of connections), or a "
           "router or firewall in between ends it";
  }
  return "look at the server's other clients and its limit of connections, its inactivity time, "
         "restarts and the network";
}

}  // namespace baudgate::control
