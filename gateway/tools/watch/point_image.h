// `PointImage` contains the present state of all points, and returns them in the order in which
// they are shown. It gets events from gateway/tools/watch/watch.h and makes rows for the table.
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

// `PointOrder` sorts the points of a device in the order of its profile. A sample does not name the
// profile, so the profile that contains most of the device's points is used. The profiles are read
// from a file that `baudgate watch` makes of the installed profiles: each line contains the names
// of a profile's points; a '-' marks points that can only be written.
//
//   current_l1 current_l2 current_l3 -reset
class PointOrder {
 public:
  PointOrder() = default;
  explicit PointOrder(std::istream& profiles);

  /// Sorts points: first those of the profile in its order, then the others by name, with input_2
  /// before input_10.
  void Sort(std::vector<std::string>& points) const;
  /// True if the point is write-only in every profile that contains this name. Such a point never
  /// has a value.
  bool IsWriteOnly(const std::string& point) const { return write_only_.contains(point); }

 private:
  using Places = std::map<std::string, std::size_t>;  // positions of points in one profile

  const Places* ProfileOf(const std::vector<std::string>& points) const;

  std::vector<Places> profiles_;
  std::set<std::string> write_only_;
};

/// How much of an event is new to the image, in rising order.
enum class News : std::uint8_t {
  nothing,  ///< the same reading, sent again
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

  /// Returns the events sorted by gateway and device, with the points of each device in the order
  /// of its profile.
  std::vector<const PointEvent*> Ordered() const;
  std::vector<PointRow> Rows(WallTime now) const;

 private:
  using Key = std::tuple<std::string, std::string, std::string>;  // gateway, device, point

  const PointOrder order_;
  std::map<Key, PointEvent> image_;
};

// `Publishers` tracks the publishers of each gateway and detects false ones. Two signs reveal a
// false publisher: two live publishers publish the same point, or the numbers of readings decrease.
// Samples and ends come from the subscriber; remarks go to the user.

struct Remark {
  enum class Weight : std::uint8_t { note, change, alarm };
  Weight weight = Weight::note;
  std::string text;  ///< contains text from the network; pass it through Harmless to show it
};

class Publishers {
 public:
  /// A gateway that was killed and started again has two publishers until the lease of the first
  /// publisher ends, so two publishers are tolerated for this time.
  static constexpr Duration kRivalsMayGo = config::kUsualLease + 1s;

  void OnSample(const dds::PointSample& sample, const dds::Origin& origin, Instant now);
  void OnStart(const dds::GatewaySample& start, const dds::PublisherId& publisher);
  void OnLeft(const dds::PublisherId& publisher);
  /// Nothing was received for a while, so publishers may have left unnoticed: forgets which are
  /// live.
  void OnDeaf();
  void Tick(Instant now);

  std::vector<Remark> TakeRemarks() { return std::exchange(remarks_, {}); }
  std::vector<std::string> Alarms() const;

 private:
  /// Two publishers of one point, while the first has not left.
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
    std::map<dds::PublisherId, WallTime> live;  ///< time of the last sample of each live publisher
    std::map<dds::PublisherId, std::int64_t> starts;
    std::optional<Rivals> rivals;
    std::string counted_back;  ///< alarm text about decreasing numbers; empty: none
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
