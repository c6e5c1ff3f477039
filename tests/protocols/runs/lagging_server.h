// LaggingServer simulates a serial server, a radio or a repeater before all devices of a line: a
// queue that holds, delays, loses, doubles or damages replies, or releases them too late. Input:
// each request with the reply of the devices. Output: what arrives at the master, and when. No I/O,
// no clock; the same seed gives the same faults.
//
//   behind = 1:   request 1 2 3 4        the first reply stays in the queue for ever
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

/// The frequency of each fault: one in this many replies; 0: never.
struct ServerFaults {
  unsigned drop = 0;
  unsigned delay = 0;  ///< delays a reply by up to `longest_delay`; later replies wait in the queue
  Duration longest_delay = 1s;
  bool growing = false;  ///< delays grow step by step up to `longest_delay`, then begin again
  /// Keeps 1…3 replies in the queue for up to eight replies, then releases or drops all at once.
  unsigned hold = 0;
  /// Each reply answers the request that came this many requests before, from the first reply on.
  std::size_t behind = 0;
  unsigned overtake = 0;  ///< puts a reply aside, and releases it before or after a later reply
  Duration aside = 500ms;
  unsigned copy = 0;
  enum class Copy : std::uint8_t {
    at_once,
    after_a_pause,
    in_place,  ///< at once after the next request; the answer to that request follows
  } copy_comes = Copy::at_once;
  unsigned cut = 0;
  unsigned damage = 0;
};

class LaggingServer {
 public:
  /// If `wire.paced` is set, a reply takes the time of its characters, after the reply before it.
  LaggingServer(const tools::TwinWire& wire, unsigned seed) : wire_(wire), random_(seed) {}

  ServerFaults faults;  ///< can be changed at any time

  std::vector<tools::TimedPiece> OnRequest(View request, Bytes reply, Instant end_of_request);

  struct Counts {
    std::size_t requests = 0;
    std::size_t lost = 0;
    std::size_t late = 0;
    std::size_t copies = 0;
    std::size_t spoilt = 0;
  };
  const Counts& counts() const { return counts_; }

  /// The latest traffic. It lets an oracle recognise valid frames that no device has sent.
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
    Bytes intact;
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
  std::deque<Reply> queue_;
  std::size_t holding_ = 0;
  std::size_t held_behind_ = 0;
  std::deque<Aside> aside_;
  std::vector<Reply> next_time_;
  unsigned delays_ = 0;
  Instant free_at_{};
  std::deque<Bytes> requests_;
  std::deque<Bytes> said_;
  std::deque<Arrival> arrivals_;
};

}  // namespace baudgate::protocols
