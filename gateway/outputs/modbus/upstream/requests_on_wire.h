// `RequestsOnWire` contains the requests that were sent to a remote server and not answered yet. It
// decides which request may be sent beside them, which request a reply answers, what follows when a
// deadline passes, and what is sent again when the connection ends. No socket, no clock; used by
// upstream.cpp.
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
  /// The number of requests on the wire at once. The last kKeptForWrites places are for short
  /// writes only, so that reads of units that do not answer cannot delay a stop command.
  static constexpr std::size_t kMost = 16;
  static constexpr std::size_t kKeptForWrites = 4;
  /// The number of requests to one unit at once; beyond it only short writes are sent.
  static constexpr std::size_t kMostPerUnit = 4;
  /// The number of deadlines that pass in a row before the connection is renewed, if the server
  /// sends nothing in that time. A unit that lets as many pass has one request at a time until it
  /// answers.
  static constexpr int kSilentDeadlines = 3;
  /// A server that closes the connection because of a request does so within this time.
  static constexpr Duration kTriedOut = std::chrono::milliseconds(200);

  /// One request on the wire, with the identical reads that its reply answers as well.
  struct Sent {
    std::uint16_t id = 0;
    std::uint8_t unit = 0;
    Bytes pdu;
    Instant at;
    Instant deadline;  ///< the latest deadline of `requests`
    bus::RouteQueue::Batch requests;

    std::uint8_t function() const { return pdu[0]; }
    bool only_reads() const { return IsRead(function()); }
    /// True if the request was on the wire before when a connection ended, and may have caused
    /// that.
    bool repeated() const {
      return std::ranges::any_of(
          requests, [](const bus::RoutedRequest& request) { return request.tries > 0; });
    }
    void Answer(Outcome outcome, View pdu, const std::string& reason) const;
  };

  /// To be called when a new connection is attempted: forgets what the last connection has shown.
  void OnConnecting(Instant now);

  bool empty() const { return sent_.empty(); }
  bool full() const { return sent_.size() >= kMost; }
  /// True if a request that is no short write may be sent to this unit. A unit that does not answer
  /// is limited to kMostPerUnit places, and to one place in the end.
  bool HasRoom(std::uint8_t unit) const;
  /// True if the request overtakes no write to its unit.
  bool MayFollow(const bus::RoutedRequest& request) const;
  /// True while a repeated request is so new that the server may still close the connection because
  /// of it.
  bool IsTryingOut(Instant now) const { return TriedOutAt(now).has_value(); }
  /// The next time after `now` at which a repeated request stops being on trial; empty: none is.
  std::optional<Instant> TriedOutAt(Instant now) const;

  /// Gives `batch` an id that no request on the wire has.
  Sent Number(bus::RouteQueue::Batch batch, Instant now);
  void Add(Sent sent) { sent_.push_back(std::move(sent)); }

  /// The PDU of the request that a reply with this id from this unit answers; empty: there is no
  /// such request.
  View PduOf(std::uint16_t id, std::uint8_t unit) const;
  struct Replied {
    std::optional<Sent> sent{};  ///< the request with this id, possibly to another unit
    bool late = false;           ///< no request waits, but an expired one had this id
  };
  /// Removes the request that a reply with this id answers.
  Replied TakeReplied(std::uint16_t id, std::uint8_t unit);

  /// Removes requests whose deadline has passed, and returns them. Requests with a later deadline
  /// that share the same exchange stay.
  std::vector<Sent> TakeExpired(Instant now);
  bool IsSilent() const { return silent_ >= kSilentDeadlines; }
  /// True if an incomplete frame with this id (empty: the id has not come yet) can only be the
  /// reply to an expired request.
  bool IsOfExpired(std::optional<std::uint16_t> id) const;
  std::optional<Instant> Deadline() const;

  /// Returns the request that may have made the server close the connection; null: none. A server
  /// that closes because of a request does so again when the request is repeated. Repeated requests
  /// are sent one at a time, so the latest of them is the suspect.
  const Sent* Suspect() const;
  /// Removes the reads that may be sent again and returns them, latest first. A write is never sent
  /// again, because the server may have carried it out. A read is sent again once, and once more
  /// each time that another request was the `reason`.
  std::vector<bus::RouteQueue::Batch> TakeReads(const Sent* reason);
  std::vector<Sent> TakeAll() { return std::exchange(sent_, {}); }
  /// Answers the requests of a client that has left. The exchange stays on the wire, so that its
  /// reply is recognised.
  void Abandon(std::uint64_t client);

 private:
  /// A request that expired on the wire: its reply may still come.
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
  std::array<int, 256> ignored_{};  // by unit: deadlines that have passed since its last reply
  int silent_ = 0;                  // deadlines that have passed since the last reply of the server
  Instant silent_from_;  // a deadline counts in silent_ only if its request was sent after this
};

}  // namespace baudgate::modbus
