// `SpaBus` is what the devices of a line share, and MakeConversation makes the conversation with
// one device. `ItemReads` chooses the requests that read the points of a relay, and `RelayIdentity`
// checks that a relay is what its profile requires.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/protocol.h"
#include "protocols/spabus/clock.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/points.h"
#include "protocols/spabus/reply.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {

// Plans how the points of a device are read: items with consecutive numbers share a request, or
// else the same item of consecutive channels.

/// Items of one category that one request may read: 1I1, 1I2, 1I3 of channel 1, or across channels
/// 1I1, 2I1, 3I1. Places in a row are numbers of items, or channels.
struct Row {
  char category = 'I';
  bool across = false;
  std::uint32_t common = 0;  ///< the channel of all items; across channels: the number of all items
  bool operator==(const Row&) const = default;
};
using ItemPlan = QueryPlan<Row>;

/// How much the device accepts in one request, as far as it is known.
struct RequestLimits {
  std::size_t items = 8;
  bool channels = true;     ///< a range of channels is accepted
  std::size_t written = 1;  ///< most items in one write
};

/// Plans requests, each without gaps between its items. `limits` are read at each planning, so a
/// lower limit takes effect at the next planning; they must outlive the plan.
ItemPlan MakePlan(std::span<const ReadPoint> points, const RequestLimits& limits,
                  Often is_often = IsFast);

/// Returns the request that reads a block: >1RI1/5: or >1R1/3I1:
Command ReadOf(unsigned slave, const Block<Row>& block);

// Chooses the requests that read the points of one relay, and learns from refusals: fewer items in
// one request, no range of channels, one value in one write. Silence to several items, while the
// relay answers other requests, teaches the same.
//
//   > >1R1/3I1:   < <1N:7:      no ranges of channels from now on: >1R1I1:
//
class ItemReads {
 public:
  /// The references must outlive this object.
  ItemReads(const config::Device& device, const Settings& settings);
  ItemReads(const ItemReads&) = delete;
  ItemReads& operator=(const ItemReads&) = delete;

  std::span<const Query> Queries() const { return plan_.queries(); }
  const std::vector<ReadPoint>& points() const { return points_; }
  const std::vector<ReadPoint>& by_address() const { return by_address_; }
  const RequestLimits& limits() const { return limits_; }
  Command Ask(unsigned slave, std::size_t query) const { return ReadOf(slave, plan_.block(query)); }

  // The functions below return true if the queries have changed.

  bool OnAnswered(std::size_t query, Instant now);
  /// Handles a refusal: `nack` is its code, `answer` its answer.
  bool TakeRefusal(std::size_t query, int nack, Answer& answer, Instant now);
  bool OnFailure(std::size_t query, Outcome outcome, Instant now);
  bool ForgetRefusals() { return plan_.ForgetRefusals(); }

  /// The relay refused a write of several values.
  void WriteAlone() { limits_.written = 1; }
  void OnReconnect();
  /// Returns what was learned, for the status; empty: nothing was learned.
  std::string Learned() const;

 private:
  RequestLimits ConfiguredLimits() const {
    return {settings_.max_items, true, settings_.write_items};
  }
  bool IsChannelRange(std::size_t query) const;
  bool ForgoChannels();

  const Settings& settings_;
  const std::vector<ReadPoint> points_;      ///< in the order of the device
  const std::vector<ReadPoint> by_address_;  ///< the same points, sorted by address
  RequestLimits limits_;  ///< lower than configured after the device refused requests as too large
  TryAgain larger_;       ///< when the configured limits are tried again
  ItemPlan plan_;
  int channel_failures_ = 0;  ///< failures of ranges of channels, while none was answered
  bool channels_work_ = false;
};

// Checks by its designation (item F) that a relay is what its profile requires:
//
//   > >7RF:    < <7D: SPAJ 140C:      F is read before the first poll
//                                     another name: only F is read until the name is right
//
class RelayIdentity {
 public:
  /// `identity` must outlive this object.
  explicit RelayIdentity(const config::Identity& identity) : identity_(identity) {}

  /// A new request is being made: an earlier request for the name that still waits must be made
  /// again.
  void OnAsk() { asked_ = false; }
  /// Returns true if the next request must read the name.
  bool WantsName();
  /// Returns true if the request that was answered or has failed was for the name. Resets the
  /// state.
  bool TakeAsked() { return std::exchange(asked_, false); }
  Answer TakeName(Answer answer);
  /// Silence contradicts no profile: the next poll reads values.
  void OnNoName() { named_ = true; }
  void OnReconnect() { named_ = false; }
  const DeviceTrouble& trouble() const { return trouble_; }

 private:
  const config::Identity& identity_;
  bool named_ = false;  ///< the relay has answered or ignored F since OnReconnect
  bool asked_ = false;
  DeviceTrouble trouble_;
};

struct SpaBus final : Bus {
  ContinuationChecksum checksum;
  ClockMessages clock;
};

/// `device` and `bus` must outlive the conversation.
std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const Settings& settings, SpaBus& bus);

}  // namespace baudgate::protocols::spabus
