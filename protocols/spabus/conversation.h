// The SPA Bus as the poller sees it: one bus per line, one conversation per device on it.
// Tasks come in, requests go to the line; frames come back from it and leave as readings.
// RelayIdentity checks that a relay is what its profile says, and ItemReads finds the requests that
// read its points.
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

// How the points of a device are read: items with consecutive numbers share a request, or else the
// same item of consecutive channels. Points come from the profile, queries go to the poller through
// the conversation. ItemReads reads the points of one relay, and learns from refusals.

/// Items of one category that one request may read: 1I1, 1I2, 1I3 of channel 1, or across channels
/// 1I1, 2I1, 3I1. Places in it are numbers, or channels.
struct Row {
  char category = 'I';
  bool across = false;
  std::uint32_t common = 0;  ///< the channel of all; across channels the number of all
  bool operator==(const Row&) const = default;
};
using ItemPlan = QueryPlan<Row>;

/// What the device takes in one request, as far as it is known.
struct RequestLimits {
  std::size_t items = 8;
  bool channels = true;     ///< a range of them
  std::size_t written = 1;  ///< items in one write
};

/// One request takes items without a gap. `limits` are read whenever requests are laid out, so that
/// the device can be asked for less from now on; they outlive the plan.
ItemPlan MakePlan(std::span<const ReadPoint> points, const RequestLimits& limits,
                  Often is_often = IsFast);

/// The request that reads a block: >1RI1/5: or >1R1/3I1:
Command ReadOf(unsigned slave, const Block<Row>& block);

// By which requests the points of one relay are read, and what its refusals teach of that: fewer
// items in one request, no range of channels, one value in one write. Silence to several items,
// beside answers to others, teaches the same.
//
//   > >1R1/3I1:   < <1N:7:      it does not know ranges of channels: >1R1I1: from now on
//
class ItemReads {
 public:
  /// Both outlive it.
  ItemReads(const config::Device& device, const Settings& settings);
  ItemReads(const ItemReads&) = delete;
  ItemReads& operator=(const ItemReads&) = delete;

  std::span<const Query> Queries() const { return plan_.queries(); }
  const std::vector<ReadPoint>& points() const { return points_; }
  const std::vector<ReadPoint>& by_address() const { return by_address_; }
  const RequestLimits& limits() const { return limits_; }
  Command Ask(unsigned slave, std::size_t query) const { return ReadOf(slave, plan_.block(query)); }

  // True: the queries are others now.

  bool OnAnswered(std::size_t query, Instant now);
  /// `answer` is the NACK to the query.
  bool TakeRefusal(std::size_t query, int nack, Answer& answer, Instant now);
  bool OnFailure(std::size_t query, Outcome outcome, Instant now);
  bool ForgetRefusals() { return plan_.ForgetRefusals(); }

  /// A write of several values is too much for the relay.
  void WriteAlone() { limits_.written = 1; }
  void OnReconnect();
  /// For the status; empty: nothing was learned.
  std::string Learned() const;

 private:
  RequestLimits ConfiguredLimits() const {
    return {settings_.max_items, true, settings_.write_items};
  }
  bool IsChannelRange(std::size_t query) const;
  bool ForgoChannels();

  const Settings& settings_;
  const std::vector<ReadPoint> points_;      ///< in the order of the device
  const std::vector<ReadPoint> by_address_;  ///< the same, sorted
  RequestLimits limits_;                     ///< less once the device has called it too much
  TryAgain larger_;                          ///< when requests are as large as configured again
  ItemPlan plan_;
  int channel_failures_ = 0;    ///< of ranges of channels, none answered so far
  bool channels_work_ = false;  ///< a range of channels was answered
};

// Whether a relay is what its profile says, by its designation (item F):
//
//   > >7RF:    < <7D: SPAJ 140C:      it is asked before the first poll
//                                     another name: it is asked for nothing else until it is right
//
class RelayIdentity {
 public:
  /// It outlives this.
  explicit RelayIdentity(const config::Identity& identity) : identity_(identity) {}

  /// A request is asked for: an earlier one that waits will be asked for again.
  void OnAsk() { asked_ = false; }
  /// True: the next request asks for the name.
  bool WantsName();
  /// The request under way asks for the name, and is answered or has failed.
  bool TakeAsked() { return std::exchange(asked_, false); }
  Answer TakeName(Answer answer);
  /// Silence contradicts nothing; the next poll asks for values.
  void OnNoName() { named_ = true; }
  void OnReconnect() { named_ = false; }
  const DeviceTrouble& trouble() const { return trouble_; }

 private:
  const config::Identity& identity_;
  bool named_ = false;  ///< it has said what it is, since OnReconnect
  bool asked_ = false;
  DeviceTrouble trouble_;
};

/// What the devices of a line share.
struct SpaBus final : Bus {
  ContinuationChecksum checksum;
  ClockMessages clock;
};

/// `device` and `bus` outlive the conversation.
std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const Settings& settings, SpaBus& bus);

}  // namespace baudgate::protocols::spabus
