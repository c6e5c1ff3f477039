// The points as they are now: what is news, and in which order they are shown. Events come from
// gateway/tools/watch/watch.h, rows go to the table. PointOrder is the order of a device's profile,
// and Publishers tells whether the publishers of a gateway can be real.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <istream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/tools/terminal/live_table.h"
#include "gateway/tools/watch/watch_lines.h"

namespace baudgate::tools {

// The order in which the points of a device are shown: that of its profile. A sample does not name
// the profile: it is the one that has the most of the device's points. Read from a file that
// `baudgate watch` makes of the installed profiles: one a line, the names of its points, those that
// can only be written with a '-' in front.
//
//   current_l1 current_l2 current_l3 -reset
//
class PointOrder {
 public:
  PointOrder() = default;
  explicit PointOrder(std::istream& profiles);

  /// Those of the profile first, the others behind them: input_2 stands before input_10.
  void Sort(std::vector<std::string>& points) const;
  /// In every profile that has a point of this name. Such a point never has a value.
  bool IsWriteOnly(const std::string& point) const { return write_only_.contains(point); }

 private:
  using Places = std::map<std::string, std::size_t>;  // of points in one profile

  const Places* ProfileOf(const std::vector<std::string>& points) const;

  std::vector<Places> profiles_;
  std::set<std::string> write_only_;
};

/// How much of an event is new to the image. Each value includes those before it.
enum class News : std::uint8_t {
  nothing,  ///< the same reading, sent once more
  reading,  ///< the same value and quality, read once more
  value,
  point,  ///< the first event of this point
};

class PointImage {
 public:
  explicit PointImage(PointOrder order) : order_(std::move(order)) {}

  News Put(const PointEvent& event);
  bool empty() const { return image_.empty(); }
  const PointOrder& order() const { return order_; }

  /// By gateway and device, and the points of each as its profile has them.
  std::vector<const PointEvent*> Ordered() const;
  /// The same for the table.
  std::vector<PointRow> Rows(WallTime now) const;

 private:
  using Key = std::tuple<std::string, std::string, std::string>;  // gateway, device, point

  const PointOrder order_;
  std::map<Key, PointEvent> image_;
};

// The publishers of each gateway, and whether they can be real. Two signs give a false publisher
// away: one key comes from two live publishers, or readings count backwards. Samples and ends come
// from the subscriber, remarks go to the viewer.

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

}  // namespace baudgate::tools
