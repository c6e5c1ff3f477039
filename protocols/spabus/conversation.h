// `SpaBus` is the state that the devices of a line share, and MakeConversation makes the
// conversation with one device. `ItemReads` chooses the requests that read the points of a relay,
// and `RelayIdentity` checks that a relay is what its profile requires.
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

// MakePlan plans how the points of a device are read: items with consecutive numbers share a
// request, or else the same item of consecutive channels.

/// Items of one category that one request can read: consecutive numbers in one channel (1I1, 1I2,
/// 1I3), or, if `across`, one number in consecutive channels (1I1, 2I1, 3I1). The positions in a
/// block of the plan are these numbers or channels.
struct Row {
  char category = 'I';
  bool across = false;
  std::uint32_t common = 0;  ///< the channel of all items; if `across`, the number of all items
  bool operator==(const Row&) const = default;
};
using ItemPlan = QueryPlan<Row>;

/// How much the device accepts in one request, as far as it was learned.
struct RequestLimits {
  std::size_t items = 8;
  bool channels = true;     ///< true: the device accepts a range of channels
  std::size_t written = 1;  ///< maximum number of items in one write
};

/// Plans requests without gaps between their items. The plan reads `limits` at each planning, so a
/// lower limit takes effect then; `limits` must outlive the plan.
ItemPlan MakePlan(std::span<const ReadPoint> points, const RequestLimits& limits,
                  Often is_often = IsFast);

/// Returns the request that reads a block, such as >1RI1/5: or >1R1/3I1:
Command ReadOf(unsigned slave, const Block<Row>& block);

// ItemReads chooses the requests that read the points of one relay, and learns from refusals: fewer
// items in one request, no range of channels, one value in one write. Silence to a read of several
// items counts as a refusal, too, if the relay answers other requests.
//
//   > >1R1/3I1:   < <1N:7:      no ranges of channels from now on: >1R1I1:
class ItemReads {
 public:
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
  /// Handles the refusal of a query. `nack` is its code; the readings of `answer` are removed until
  /// the refusal is certain.
  bool TakeRefusal(std::size_t query, int nack, Answer& answer, Instant now);
  bool OnFailure(std::size_t query, Outcome outcome, Instant now);
  bool ForgetRefusals() { return plan_.ForgetRefusals(); }

  /// Call it if the relay has refused a write of several values: values are then written one by
  /// one.
  void WriteAlone() { limits_.written = 1; }
  void OnReconnect();
  /// Returns a text for the status: what was learned about requests. Empty: nothing was learned.
  std::string Learned() const;

 private:
  RequestLimits ConfiguredLimits() const {
    return {settings_.max_items, true, settings_.write_items};
  }
  bool IsChannelRange(std::size_t query) const;
  bool ForgoChannels();

  const Settings& settings_;
  const std::vector<ReadPoint> points_;
  const std::vector<ReadPoint> by_address_;
  /// The present limits; lower than configured after the device has refused requests as too large.
  RequestLimits limits_;
  TryAgain larger_;  ///< when the configured limits are tried again
  ItemPlan plan_;
  /// Number of failed requests for a range of channels, as long as none was answered.
  int channel_failures_ = 0;
  bool channels_work_ = false;
};

// RelayIdentity checks by the designation of a relay (item F) that the relay is what its profile
// requires:
//
//   > >7RF:    < <7D: SPAJ 140C:      F is read before the first poll
//                                     another name: only F is read until the name is right
//
class RelayIdentity {
 public:
  explicit RelayIdentity(const config::Identity& identity) : identity_(identity) {}

  /// Call it when a request is made that is not a probe. A request for the name that was not sent
  /// is then forgotten, and WantsName asks for the name again.
  void OnAsk() { asked_ = false; }
  bool WantsName();
  /// Returns true if the request that was answered or has failed was for the name. The next call
  /// returns false.
  bool TakeAsked() { return std::exchange(asked_, false); }
  Answer TakeName(Answer answer);
  /// Call it if the name was not answered. Silence contradicts no profile, so the next poll reads
  /// values.
  void OnNoName() { named_ = true; }
  void OnReconnect() { named_ = false; }
  const DeviceTrouble& trouble() const { return trouble_; }

 private:
  const config::Identity& identity_;
  bool named_ = false;  ///< true: the relay has answered or ignored F since OnReconnect
  bool asked_ = false;
  DeviceTrouble trouble_;
};

struct SpaBus final : Bus {
  ContinuationChecksum checksum;
  ClockMessages clock;
};

std::unique_ptr<Conversation> MakeConversation(const config::Device& device,
                                               const Settings& settings, SpaBus& bus);

}  // namespace baudgate::protocols::spabus
