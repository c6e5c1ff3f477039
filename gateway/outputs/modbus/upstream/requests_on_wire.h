// `RequestsOnWire` contains the requests that were sent to a remote server and are not answered
// yet. It decides which further requests may be sent, which request a reply answers, what happens
// when a deadline passes, and which requests are sent again when the connection ends. No socket, no
// clock. gateway/outputs/modbus/upstream/upstream.cpp uses it.
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
  /// The most requests on the wire. The last kKeptForWrites of them are for short writes only
  /// (RouteQueue::IsShortWrite), so that reads from units that do not answer cannot delay a stop
  /// command.
  static constexpr std::size_t kMost = 16;
  static constexpr std::size_t kKeptForWrites = 4;
  /// The most requests on the wire to one unit; beyond this number only short writes are sent.
  static constexpr std::size_t kMostPerUnit = 4;
  /// If this number of deadlines passes in a row and the server sends nothing meanwhile, the
  /// connection is renewed. If a unit lets this number of deadlines pass, it gets only one request
  /// at a time until it answers.
  static constexpr int kSilentDeadlines = 3;
  /// A repeated request may have made the server close the connection. For this time after it was
  /// sent (its trial), no other repeated request is sent: a server that closes the connection
  /// because of a request does so within this time.
  static constexpr Duration kTriedOut = std::chrono::milliseconds(200);

  /// A request on the wire, with identical reads of other clients, which its reply answers as well.
  struct Sent {
    std::uint16_t id = 0;
    std::uint8_t unit = 0;
    Bytes pdu;
    Instant at;
    Instant deadline;  ///< the latest deadline among `requests`
    bus::RouteQueue::Batch requests;

    std::uint8_t function() const { return pdu[0]; }
    bool only_reads() const { return IsRead(function()); }
    /// True if the request was already on the wire when an earlier connection ended, so it may be
    /// the cause.
    bool repeated() const {
      return std::ranges::any_of(
          requests, [](const bus::RoutedRequest& request) { return request.tries > 0; });
    }
    void Answer(Outcome outcome, View pdu, const std::string& reason) const;
  };

  /// Must be called when a new connection is attempted: forgets the silence and the expired
  /// requests of the last connection.
  void OnConnecting(Instant now);

  bool empty() const { return sent_.empty(); }
  bool full() const { return sent_.size() >= kMost; }
  /// True if a request other than a short write (RouteQueue::IsShortWrite) may be sent to this unit
  /// now: fewer than kMost - kKeptForWrites requests are on the wire, and fewer than kMostPerUnit
  /// of them go to this unit. A unit that let kSilentDeadlines deadlines in a row pass gets one at
  /// a time.
  bool HasRoom(std::uint8_t unit) const;
  /// True if no write to the request's unit is on the wire. A broadcast waits for writes to all
  /// units.
  bool MayFollow(const bus::RoutedRequest& request) const;
  /// True while a repeated request is on trial (kTriedOut).
  bool IsTryingOut(Instant now) const { return TriedOutAt(now).has_value(); }
  /// Returns when the next trial of a repeated request ends, which is kTriedOut after the request
  /// was sent; nothing: no request is on trial.
  std::optional<Instant> TriedOutAt(Instant now) const;

  /// Gives `batch` an id that no request on the wire has.
  Sent Number(bus::RouteQueue::Batch batch, Instant now);
  void Add(Sent sent) { sent_.push_back(std::move(sent)); }

  /// Returns the PDU of the request that a reply with this id from this unit answers; empty: there
  /// is no such request.
  View PduOf(std::uint16_t id, std::uint8_t unit) const;
  struct Replied {
    /// The request with this id; it can have been sent to another unit.
    std::optional<Sent> sent{};
    bool late = false;  ///< no request waits for the reply, but an expired request had this id
  };
  /// Removes and returns the request that a reply with this id answers. Ends the silence of the
  /// server and of the unit.
  Replied TakeReplied(std::uint16_t id, std::uint8_t unit);

  /// Removes and returns the requests whose deadline has passed. Requests with a later deadline
  /// that share the exchange stay.
  std::vector<Sent> TakeExpired(Instant now);
  bool IsSilent() const { return silent_ >= kSilentDeadlines; }
  /// True if an incomplete frame with this id (nothing: the id has not been received yet) can only
  /// be the reply to an expired request.
  bool IsOfExpired(std::optional<std::uint16_t> id) const;
  std::optional<Instant> Deadline() const;

  /// Returns the request that may have made the server close the connection; null: there is no such
  /// request. A server that closes because of a request does so again when the request is repeated.
  /// Repeated requests are sent one at a time, so the latest repeated request is the suspect.
  const Sent* Suspect() const;
  /// Removes the reads that are allowed to be sent again and returns them, latest first. A write is
  /// never sent again, because the server has perhaps carried it out. A read is sent again once,
  /// and again each time that another request was the `reason` why the connection ended.
  std::vector<bus::RouteQueue::Batch> TakeReads(const Sent* reason);
  std::vector<Sent> TakeAll() { return std::exchange(sent_, {}); }
  /// Answers the requests of a client that has left. The exchange stays on the wire, so that its
  /// reply is recognised.
  void Abandon(std::uint64_t client);

 private:
  /// A request whose deadline has passed on the wire. Its reply can still come.
  struct Expired {
    std::uint16_t id = 0;
    std::uint8_t unit = 0;
    bool operator==(const Expired&) const = default;
  };

  std::vector<Sent>::const_iterator Find(std::uint16_t id) const {
    return std::ranges::find(sent_, id, &Sent::id);
  }

  std::vector<Sent> sent_;
  std::vector<Expired> expired_;  // the latest expired requests of this connection
  std::uint16_t next_id_ = 0;
  std::array<int, 256> ignored_{};  // per unit: deadlines that have passed since its last reply
  int silent_ = 0;                  // deadlines that have passed since the server's last reply
  Instant silent_from_;  // silent_ counts only deadlines of requests that were sent after this time
};

}  // namespace baudgate::modbus
