// The clients of transparent routes on one line: when they were served last, and which slaves they
// want back. gateway/bus/writes/route_queue.h keeps and chooses their requests,
// gateway/bus/jobs/job_run.h sends and answers them: no conversation takes part.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "gateway/bus/devices/roster.h"
#include "gateway/bus/writes/route_queue.h"

namespace baudgate {

class RoutedSide {
 public:
  /// Clients of transparent routes that poll do so at least this often.
  static constexpr Duration kClientsReturn = std::chrono::seconds(2);
  /// A client that asked for an offline slave is assumed to want it back for this long.
  static constexpr Duration kStillWanted = std::chrono::minutes(1);

  /// It outlives this.
  explicit RoutedSide(RouteQueue& queue) : queue_(queue) {}

  /// An exchange for a client was answered.
  void OnAnswered(Instant now) { answered_at_ = now; }
  /// When the clients count as gone; empty: there were none.
  std::optional<Instant> ClientsGone() const;
  /// Clients do not say when they will be back: one that was just served may ask at any moment.
  bool ClientsAreHere(Instant now) const { return ClientsGone() && now < *ClientsGone(); }

  /// Reads of an offline slave, except the first `keep`: to be answered at once. What was asked for
  /// is remembered for its probes.
  std::vector<RoutedRequest> TakeHopeless(const Member& slave, std::size_t keep,
                                          const PduCarrier& carrier, Instant now);
  /// Whether a client that has no request waiting right now still wants to know if this slave is
  /// back: a client that asks its slaves one after the other waits for others then, so its last
  /// read is repeated in its place. For 2 s after that at once, up to 1 min only directly after
  /// another exchange (`behind`). Needed by
  /// AskedInTurn.ASlaveThatReturnsIsFoundThoughItsClientNeverWaitsForIt.
  bool MayRepeatRead(const Member& slave, bool behind, Instant now) const;
  /// The read, without a client.
  RouteQueue::Batch RepeatRead(const Member& slave) const;

 private:
  struct Refused {
    Bytes pdu;  // the last read of a client from it
    Instant at{};
  };

  RouteQueue& queue_;
  std::optional<Instant> answered_at_;
  std::map<std::uint8_t, Refused> refused_;  // by slave, while offline
};

}  // namespace baudgate
