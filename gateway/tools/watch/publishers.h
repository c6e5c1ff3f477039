// The publishers of each gateway, and whether they can be real. Two signs give a false publisher
// away: one key comes from two live publishers, or readings count backwards. Samples and ends come
// from the subscriber, remarks go to the viewer.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/fast/subscriber.h"

namespace baudgate {

struct Remark {
  enum class Weight : std::uint8_t { note, change, alarm };
  Weight weight = Weight::note;
  std::string text;  ///< of foreign names: Harmless before it is shown
};

class Publishers {
 public:
  /// A gateway that was killed and started again has two publishers until the lease of the first
  /// one ends: for so long it is not judged.
  static constexpr Duration kRivalsMayGo = config::kUsualLease + 1s;

  void OnSample(const dds::PointSample& sample, const dds::Origin& origin, Instant now);
  void OnStart(const dds::GatewaySample& start, const dds::PublisherId& publisher);
  void OnLeft(const dds::PublisherId& publisher);
  /// Nothing was heard for a while: whoever published may have left meanwhile.
  void OnDeaf();
  void Tick(Instant now);

  /// What is new since the last call.
  std::vector<Remark> TakeRemarks() { return std::exchange(remarks_, {}); }
  /// The alarms that still hold.
  std::vector<std::string> Alarms() const;

 private:
  /// The second to publish a point that the first, as far as we know, publishes still.
  struct Rivals {
    dds::PublisherId first;
    dds::PublisherId second;
    WallTime since;
    Instant judged_at;
    std::string point;
    bool alarm = false;
  };
  struct Gateway {
    std::optional<dds::PublisherId> current;
    std::map<dds::PublisherId, WallTime> live;  ///< when last heard
    std::map<dds::PublisherId, std::int64_t> starts;
    std::optional<Rivals> rivals;
    std::string counted_back;  ///< the alarm about it
  };
  struct Point {
    dds::PublisherId publisher;
    std::uint64_t seq = 0;
    std::int64_t start = 0;
  };
  using Names = std::pair<const std::string, Gateway>;
  using Key = std::tuple<std::string, std::string, std::string>;

  void Say(Remark::Weight weight, std::string text);
  void Alarm(Names& of);
  void TookOver(Names& of, dds::PublisherId first, dds::PublisherId second);
  void CheckRivals(Names& of, const Point& before, const dds::PublisherId& publisher,
                   const std::string& point, WallTime received, Instant now);
  void CheckSeq(Names& of, const Point& before, const dds::PointSample& sample, std::int64_t start);
  static bool StartedLater(const Gateway& gateway, const dds::PublisherId& second,
                           const dds::PublisherId& first);

  std::map<std::string, Gateway> gateways_;
  std::map<Key, Point> points_;
  std::vector<Remark> remarks_;
};

}  // namespace baudgate
