// `RequestsOnWire` contains the unanswered requests to a remote server: it decides which further
// requests may be sent, which request a reply answers, and which are sent again when the connection
// ends. No socket, no clock.
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
  /// The last kKeptForWrites places are for short writes only, so that reads from units that do not
  /// answer cannot delay a stop command.
  static constexpr std::size_t kMost = 16;
  static constexpr std::size_t kKeptForWrites = 4;
  /// The most requests on the wire to one unit; beyond this number only short writes are sent.
  static constexpr std::size_t kMostPerUnit = 4;
  /// After this number of deadlines in a row without a reply, the connection is renewed. A unit
  /// that lets so many pass gets one request at a time until it answers.
  static constexpr int kSilentDeadlines = 3;
  /// A server that closes the connection because of a repeated request does so within this time.
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
    /// True if it was on the wire when an earlier connection ended, so it may be the cause.
    bool repeated() const {
      return std::ranges::any_of(
          requests, [](const bus::RoutedRequest& request) { return request.tries > 0; });
    }
    void Answer(Outcome outcome, View pdu, const std::string& reason) const;
  };

  /// Clears the observations about the last connection, when a new one is attempted.
  void OnConnecting(Instant now);

  bool empty() const { return sent_.empty(); }
  bool full() const { return sent_.size() >= kMost; }
  /// True if a request other than a short write (RouteQueue::IsShortWrite) may be sent to this
  /// unit: fewer than kMost - kKeptForWrites are on the wire, and fewer than kMostPerUnit to this
  /// unit (none, if it let kSilentDeadlines in a row pass).
  bool HasRoom(std::uint8_t unit) const;
  /// True if the request overtakes no write to its unit; a broadcast: no write to any unit.
  bool MayFollow(const bus::RoutedRequest& request) const;
  /// True while the server can still close the connection because of a repeated request.
  bool IsTryingOut(Instant now) const { return TriedOutAt(now).has_value(); }
  /// Returns the end of the next trial: kTriedOut after the repeated request was sent.
  std::optional<Instant> TriedOutAt(Instant now) const;

  /// Gives `batch` an id that no request on the wire has.
  Sent Number(bus::RouteQueue::Batch batch, Instant now);
  void Add(Sent sent) { sent_.push_back(std::move(sent)); }

  /// Returns the PDU of the request that this reply answers; empty: there is none.
  View PduOf(std::uint16_t id, std::uint8_t unit) const;
  struct Replied {
    /// The request with this id; it can have been sent to another unit.
    std::optional<Sent> sent{};
    bool late = false;  ///< no request waits for the reply, but an expired request had this id
  };
  /// Removes and returns the request, and counts that the server and the unit have answered.
  Replied TakeReplied(std::uint16_t id, std::uint8_t unit);

  /// Requests with a later deadline that share the exchange stay.
  std::vector<Sent> TakeExpired(Instant now);
  bool IsSilent() const { return silent_ >= kSilentDeadlines; }
  /// True if the incomplete frame can only be the reply to an expired request.
  bool IsOfExpired(std::optional<std::uint16_t> id) const;
  std::optional<Instant> Deadline() const;

  /// Returns the request that may have made the server close the connection, or null. Repeated
  /// requests are sent one at a time, so the latest one is the suspect.
  const Sent* Suspect() const;
  /// Removes the reads that may be sent again, latest first. A write is never sent again, because
  /// the server has perhaps carried it out. A read is sent again once, and each time that another
  /// request was the `reason`.
  std::vector<bus::RouteQueue::Batch> TakeReads(const Sent* reason);
  std::vector<Sent> TakeAll() { return std::exchange(sent_, {}); }
  /// The exchange of an abandoned request stays on the wire, so that its reply is recognised.
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
