// A serial server, a radio or a repeater before all devices of a line: one queue of replies that it
// holds, delays, loses, doubles, damages or hands on too late. Sans-I/O, and the same faults for
// the same seed: told of each request and of what the devices say to it, it gives what arrives at
// the master, and when.
//
//   behind = 1:   request 1 2 3 4        replies, in one queue: the first is kept back for ever
//                 arrives - 1 2 3        "-": nothing
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <random>
#include <string_view>
#include <vector>

#include "gateway/tools/simulate/twin_faults.h"

namespace baudgate::protocols {

/// What goes wrong, and how often: one reply in so many; 0: none.
struct ServerFaults {
  unsigned drop = 0;
  unsigned delay = 0;  ///< by up to `longest_delay`; what comes behind it waits in the queue
  Duration longest_delay = 1s;
  bool growing = false;  ///< each delay a tenth of `longest_delay` longer, then from the beginning
  unsigned hold = 0;     ///< behind by 1…3 for up to eight replies, then all at once, or all lost
  std::size_t behind = 0;  ///< every reply releases the one so many before it, at once and for ever
  unsigned overtake = 0;   ///< a reply is put aside and comes behind or in front of a later one
  Duration aside = 500ms;  ///< at most for so long: then it is thrown away
  unsigned copy = 0;       ///< a reply comes twice
  enum class Copy : std::uint8_t {
    at_once,
    after_a_pause,  ///< of up to half a second
    in_place,       ///< at once when the next request comes; the answer to that comes behind it
  } copy_comes = Copy::at_once;
  unsigned cut = 0;     ///< the end of a reply is lost
  unsigned damage = 0;  ///< a few bits of it are wrong
};

class LaggingServer {
 public:
  /// `wire.paced`: replies take the time of their characters, one behind the other.
  LaggingServer(const tools::TwinWire& wire, unsigned seed) : wire_(wire), random_(seed) {}

  ServerFaults faults;  ///< may change at any time

  /// `reply`: of the device that was asked; empty: it is silent.
  std::vector<tools::TimedPiece> OnRequest(View request, Bytes reply, Instant end_of_request);

  struct Counts {
    std::size_t requests = 0;
    std::size_t lost = 0;
    std::size_t late = 0;  ///< delayed, held back or put aside
    std::size_t copies = 0;
    std::size_t spoilt = 0;  ///< cut or damaged
  };
  const Counts& counts() const { return counts_; }

  /// The latest of all that it was told and has handed on, for a judge of damage that nobody can
  /// detect: a frame with a good check value that no device has said.
  struct Arrival {
    Instant at;
    Bytes bytes;
    Bytes intact;  ///< the reply before it was cut or damaged; empty: `bytes` is intact
  };
  static constexpr std::size_t kKept = 64;
  const std::deque<Bytes>& requests() const { return requests_; }
  const std::deque<Bytes>& said() const { return said_; }
  const std::deque<Arrival>& arrivals() const { return arrivals_; }

 private:
  struct Reply {
    Bytes bytes;
    Bytes intact;  // see Arrival
  };
  struct Aside {
    Reply reply;
    Instant until;
  };

  bool OneIn(unsigned count) { return count > 0 && random_() % count == 0; }
  Duration UpTo(Duration most);
  Reply Spoil(Bytes reply);
  void Enqueue(Reply reply, Instant end_of_request, std::vector<Reply>& comes);
  void Release(std::vector<Reply>& comes);
  Duration NextDelay();
  void Say(Reply reply, Instant from, Instant end_of_request,
           std::vector<tools::TimedPiece>& pieces);

  tools::TwinWire wire_;
  std::mt19937 random_;
  Counts counts_;
  std::deque<Reply> queue_;  // kept back: behind by so many
  std::size_t holding_ = 0;  // replies behind by `held_behind_` until the queue is emptied
  std::size_t held_behind_ = 0;
  std::deque<Aside> aside_;
  std::vector<Reply> next_time_;  // copies that wait for the next request
  unsigned delays_ = 0;
  Instant free_at_{};  // the last character of what has been handed on
  std::deque<Bytes> requests_;
  std::deque<Bytes> said_;
  std::deque<Arrival> arrivals_;
};

}  // namespace baudgate::protocols
