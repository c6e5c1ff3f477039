// `PointImage` contains the present state of all points, and returns them in the order in which
// they are shown. gateway/tools/watch/watch.h passes events to it and shows its rows in a table.
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

// `PointOrder` sorts the points of a device in the order of its profile. A sample does not contain
// the profile, so the profile that contains most of the device's points is used. The profiles come
// from a file that `baudgate watch` makes of the installed profiles: each line contains the names
// of a profile's points; '-' marks a point that can only be written.
//
//   current_l1 current_l2 current_l3 -reset
class PointOrder {
 public:
  PointOrder() = default;
  explicit PointOrder(std::istream& profiles);

  /// Sorts points: first the points of the profile in its order, then the others by name, and
  /// numbers in names by value, so that input_2 comes before input_10.
  void Sort(std::vector<std::string>& points) const;
  /// True if the point is write-only in every profile that contains this name. A write-only point
  /// never has a value.
  bool IsWriteOnly(const std::string& point) const { return write_only_.contains(point); }

 private:
  // Key: point, value: its position in the profile.
  using Places = std::map<std::string, std::size_t>;

  const Places* ProfileOf(const std::vector<std::string>& points) const;

  std::vector<Places> profiles_;
  std::set<std::string> write_only_;
};

/// How much of an event is new to the image, in ascending order.
enum class News : std::uint8_t {
  nothing,  ///< the last reading, sent again
  reading,  ///< a new reading with the same value and quality
  value,
  point,  ///< the first event of this point
};

class PointImage {
 public:
  explicit PointImage(PointOrder order) : order_(std::move(order)) {}

  News Put(const PointEvent& event);
  bool empty() const { return image_.empty(); }
  const PointOrder& order() const { return order_; }

  /// Returns the latest event of each point, sorted by gateway and device; the points of a device
  /// are in the order of its profile.
  std::vector<const PointEvent*> Ordered() const;
  std::vector<PointRow> Rows(WallTime now) const;

 private:
  using Key = std::tuple<std::string, std::string, std::string>;  // gateway, device, point

  const PointOrder order_;
  std::map<Key, PointEvent> image_;
};

// `Publishers` tracks the publishers of each gateway, and detects a false publisher by two signs:
// two live publishers publish the same point, or the numbers of readings decrease. The subscriber
// reports samples and ends; remarks are shown to the user.

struct Remark {
  enum class Weight : std::uint8_t { note, change, alarm };
  Weight weight = Weight::note;
  /// Contains text from the network; must be passed through Harmless before it is shown.
  std::string text;
};

class Publishers {
 public:
  /// Two publishers of one gateway raise no alarm for this time: if a gateway was killed and
  /// started again, it has two until the lease of the first publisher ends.
  static constexpr Duration kRivalsMayGo = config::kUsualLease + 1s;

  void OnSample(const dds::PointSample& sample, const dds::Origin& origin, Instant now);
  void OnStart(const dds::GatewaySample& start, const dds::PublisherId& publisher);
  void OnLeft(const dds::PublisherId& publisher);
  /// Must be called if nothing was received for a while, because publishers may have ended
  /// unnoticed. Forgets which publishers are live.
  void OnDeaf();
  void Tick(Instant now);

  std::vector<Remark> TakeRemarks() { return std::exchange(remarks_, {}); }
  std::vector<std::string> Alarms() const;

 private:
  /// Two publishers of one point, from the first sample of the second until one of them ends.
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
    /// The live publishers, each with the time of its last sample.
    std::map<dds::PublisherId, WallTime> live;
    std::map<dds::PublisherId, std::int64_t> starts;
    std::optional<Rivals> rivals;
    /// Alarm text: the numbers of readings decreased; empty: the numbers did not decrease.
    std::string counted_back;
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
