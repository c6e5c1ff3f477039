// Requests that a server elsewhere has been sent and has not answered: what may join them, whose a
// reply is, what a deadline means that passes, and what goes out once more when the connection
// ends. No socket, no clock; for upstream.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/writes/route_queue.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::modbus {

class RequestsOnWire {
 public:
  /// The last places are for short writes, so that reads of units that do not answer hold up no
  /// stop.
  static constexpr std::size_t kMost = 16;
  static constexpr std::size_t kKeptForWrites = 4;
  /// At most so many of these go to one unit; beyond them only short writes go out.
  static constexpr std::size_t kMostPerUnit = 4;
  /// Deadlines that pass one after the other without a sign of the server: then the connection
  /// is made again. Without a sign of one unit: then it has one request at a time until it answers.
  static constexpr int kSilentDeadlines = 3;
  /// A server that closes the connection because of a request does so within this time.
  static constexpr Duration kTriedOut = std::chrono::milliseconds(200);

  /// One of them, with the identical reads that its reply answers as well.
  struct Sent {
    std::uint16_t id = 0;
    std::uint8_t unit = 0;
    Bytes pdu;
    Instant at;
    Instant deadline;  ///< the last of its requests'
    bus::RouteQueue::Batch requests;

    std::uint8_t function() const { return pdu[0]; }
    /// Functions that only read, whoever the server is.
    bool only_reads() const { return IsRead(function()); }
    /// It was on the wire when a connection ended, and may have been the reason.
    bool repeated() const {
      return std::ranges::any_of(
          requests, [](const bus::RoutedRequest& request) { return request.tries > 0; });
    }
    void Answer(Outcome outcome, View pdu, const std::string& reason) const;
  };

  /// There is a connection to be tried: nothing is known of it.
  void OnConnecting(Instant now);

  bool empty() const { return sent_.empty(); }
  bool full() const { return sent_.size() >= kMost; }
  /// For a request that is no short write. A unit that does not answer takes neither all places
  /// nor, in the end, more than one.
  bool HasRoom(std::uint8_t unit) const;
  /// It overtakes no write to its unit.
  bool MayFollow(const bus::RoutedRequest& request) const;
  /// The server has not closed yet because of the request that is repeated, and may.
  bool IsTryingOut(Instant now) const { return TriedOutAt(now).has_value(); }
  std::optional<Instant> TriedOutAt(Instant now) const;

  /// With an id that none of them has.
  Sent Number(bus::RouteQueue::Batch batch, Instant now);
  void Add(Sent sent) { sent_.push_back(std::move(sent)); }

  /// The PDU of the request that a reply of this unit answers; empty: there is none.
  View PduOf(std::uint16_t id, std::uint8_t unit) const;
  struct Replied {
    std::optional<Sent> sent{};  ///< the request with this id, possibly to another unit
    bool late = false;           ///< no request waits, but an expired one had this id
  };
  Replied TakeReplied(std::uint16_t id, std::uint8_t unit);

  /// Those whose requests have expired, in part or all of them.
  std::vector<Sent> TakeExpired(Instant now);
  bool IsSilent() const { return silent_ >= kSilentDeadlines; }
  /// A frame that has begun with this id, if that much of it has come, can only be of those that
  /// have expired.
  bool IsOfExpired(std::optional<std::uint16_t> id) const;
  /// The soonest of all.
  std::optional<Instant> Deadline() const;

  /// What may have been the reason that the server has ended the connection. One that closes
  /// because of a request does so again when that is repeated, and of those one at a time is on the
  /// wire: the latest of them was the reason. Null: none is.
  const Sent* Suspect() const;
  /// What may be sent once more, to be returned in this order. Whether the server has carried out a
  /// write cannot be known; a read may be sent once more, and again where `reason` was another.
  std::vector<bus::RouteQueue::Batch> TakeReads(const Sent* reason);
  std::vector<Sent> TakeAll() { return std::exchange(sent_, {}); }
  /// Answers the requests of a client that has left. What is on the wire stays there, so that its
  /// reply is known when it comes.
  void Abandon(std::uint64_t client);

 private:
  /// Its deadline has passed on the wire, and its reply may still come.
  struct Expired {
    std::uint16_t id = 0;
    std::uint8_t unit = 0;
    bool operator==(const Expired&) const = default;
  };

  std::vector<Sent>::const_iterator Find(std::uint16_t id) const {
    return std::ranges::find(sent_, id, &Sent::id);
  }

  std::vector<Sent> sent_;
  std::vector<Expired> expired_;  // the latest of this connection
  std::uint16_t next_id_ = 0;
  std::array<int, 256> ignored_{};  // by unit: deadlines that passed since it answered
  int silent_ = 0;                  // deadlines that passed since the server gave a sign
  Instant silent_from_;             // what was sent later counts as the next of them
};

}  // namespace baudgate::modbus
