// Requests of several lanes on one Modbus TCP connection: on the way each has a number of its own,
// and a reply goes to the lane whose request had its number and unit, to nobody else. Watches
// whether the server is up to several requests at a time. Sans-I/O; used by lanes.h.
//
//   lane 0  > 00 01 00 00 00 06 14 03 …   on the connection  > 00 07 00 00 00 06 14 03 …
//   lane 1  > 00 01 00 00 00 06 15 03 …                      > 00 08 00 00 00 06 15 03 …
//   lane 1  < 00 01 00 00 00 05 15 03 …                      < 00 08 00 00 00 05 15 03 …
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/modbus/wire/mbap.h"

namespace baudgate {

/// What shows that a server is not up to it: it closes the connection under several requests, or
/// loses, delays or refuses as busy what it answers well when it is asked alone. Three times in ten
/// minutes are enough. A reply that fits no request is enough at once.
class Pipeline {
 public:
  /// A unit that left a request unanswered among others is read alone the next time: reads of
  /// others wait for its reply so long at most, and it waits for theirs. Nothing but reads ever
  /// waits here: a write is not sent later than its line has sent it.
  static constexpr Duration kAlone = 500ms;
  static constexpr Duration kClear = 300ms;
  static constexpr std::size_t kMostSigns = 3;
  static constexpr Duration kSignsCount = 10min;
  /// What one hiccup of the network does to all lanes is one sign.
  static constexpr Duration kApart = 5s;

  explicit Pipeline(std::size_t lanes) : lanes_(lanes) {}

  void OnOpened();
  /// The server, or what is on the way to it, has ended the connection.
  void OnLost(Instant now);

  /// A whole request. One of a lane at a time: the one before is answered or given up.
  void OnRequest(std::size_t lane, View request, Instant now);
  /// The lane waits for no reply any more. If its request has not been sent yet, it never will be.
  void OnNoReply(std::size_t lane, Instant now);
  struct Reply {
    std::size_t lane = 0;
    Bytes bytes;  ///< a whole message, numbered as the lane's request was
  };
  std::vector<Reply> OnBytes(View bytes, Instant now);
  void OnTimer(Instant now) { Pump(now); }
  std::optional<Instant> Deadline() const;

  /// What is to be sent now, in this order.
  std::vector<Bytes> TakeOut();

  /// Why this server is to be asked one at a time; empty: nothing is known against it. Then nothing
  /// is handed over any more.
  const std::string& verdict() const { return verdict_; }
  /// A whole message has come since then.
  bool HeardSince(Instant when) const { return heard_ && *heard_ >= when; }

 private:
  struct Asked {
    std::size_t lane = 0;
    std::array<std::uint8_t, 2> number{};  ///< the lane's
    std::uint8_t unit = 0;
    bool shared = false;  ///< another was under way at some time
    bool alone = false;   ///< sent alone, to see whether that helps
    bool given_up = false;
    bool answered = false;
  };
  struct Lane {
    Bytes waiting;                      ///< not sent yet
    bool under_way = false;             ///< its latest request
    std::deque<std::uint16_t> numbers;  ///< of its latest requests, oldest first
  };
  struct Unit {
    bool suspect = false;  ///< silent, or busy, when others were asked as well
    bool absent = false;   ///< silent when it was asked alone, too
  };
  struct Alone {
    std::size_t lane = 0;
    bool sent = false;
    Instant until{};
  };

  void Pump(Instant now);
  bool MayGo(std::size_t lane, Instant now);
  void Send(std::size_t lane);
  std::uint16_t Number(std::size_t lane, View request);
  Asked& LastOf(const Lane& lane) { return asked_.at(lane.numbers.back()); }
  std::size_t UnderWay() const;
  void OnReply(Asked& asked, View message, Instant now);
  void Sign(std::string text, Instant now);

  std::vector<Lane> lanes_;
  std::deque<std::size_t> turns_;  // lanes whose requests wait
  std::map<std::uint16_t, Asked> asked_;
  std::uint16_t next_ = 0;
  std::array<Unit, 256> units_{};
  std::optional<Alone> alone_;
  modbus::MbapAssembler assembler_;
  std::vector<Bytes> out_;
  std::deque<Instant> signs_;
  std::string verdict_;
  std::optional<Instant> heard_;
};

}  // namespace baudgate
