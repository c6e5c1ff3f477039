// `LivePoints` decides which points are published now: after a change of value or quality, and all
// of them after each connection, because a broker may have lost its retained messages. A slow
// network skips old values: a point that changes several times is published once, with its latest
// value. No network: the caller publishes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/mqtt/messages.h"

namespace baudgate::mqtt {

class LivePoints {
 public:
  struct Point {
    const config::Line& line;
    const config::Device& device;
    const config::Point& point;
    std::uint32_t device_number = 0;
    std::uint32_t number = 0;  ///< number of the point in its device
    bool first = false;        ///< the first point of its device since StartAnew
  };
  /// Publishes the point. False: the network is busy, so the point is published later.
  using Publish = std::function<bool(const Point& point, const Reading& reading)>;
  /// Receives a point that was published and that a reload has removed.
  using Removed = std::function<void(const std::string& line, const std::string& device,
                                     const config::Point& point)>;

  /// `store` must outlive this object.
  explicit LivePoints(bus::PointStore& store) : store_(store), feed_(store.Subscribe()) {}
  ~LivePoints() { store_.Unsubscribe(feed_); }

  /// Sets the configuration at the start and after a reload.
  void Configure(const std::shared_ptr<const config::Config>& config, const Removed& removed);
  /// Makes all points due.
  void StartAnew();
  /// Publishes what is due.
  void Send(Now now, const Publish& publish);
  /// Publishes all points of a device, changed or not.
  void SendAll(std::uint32_t device, Now now, const Publish& publish);
  /// Returns the number of devices, with those that were removed.
  std::uint32_t size() const { return static_cast<std::uint32_t>(devices_.size()); }
  /// True if each point was published since StartAnew.
  bool all_sent() const { return all_sent_; }
  /// Calls `visit` with each point that is published.
  void Each(const std::function<void(const Point&)>& visit) const;
  void EachOf(std::uint32_t device, const std::function<void(const Point&)>& visit) const;
  /// True if this point is published.
  bool Has(std::uint32_t device, std::uint32_t point) const;

 private:
  struct Sent {
    double number = 0;
    std::size_t hash = 0;
    std::uint16_t quality = 0;
    bool known = false;
    bool wanted = false;
  };
  struct Device {
    std::shared_ptr<const config::Line> line;
    std::shared_ptr<const config::Device> device;
    std::vector<Sent> points;
    bool touched = false;
  };
  bool SendOne(const bus::PointRef& at, Now now, const Publish& publish);

  bus::PointStore& store_;
  const std::shared_ptr<bus::ChangeFeed> feed_;
  std::vector<Device> devices_;  // index: number in the store; `device` null: removed
  bus::Changes changes_;
  std::size_t next_ = 0;  // changes_.points before this index are published
  bool all_sent_ = false;
};

}  // namespace baudgate::mqtt
