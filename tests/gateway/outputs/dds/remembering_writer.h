// A writer that only records its samples, for tests of the sender and the publisher.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds::testing {

class RememberingWriter : public SampleWriter {
 public:
  Sent Write(const PointSample& sample) override { return Keep(points, sample); }
  Sent Write(const DeviceSample& sample) override { return Keep(devices, sample); }
  Sent Write(const GatewaySample& sample) override { return Keep(gateways, sample); }
  Sent Write(const EventSample& sample) override { return Keep(events, sample); }
  Sent Write(const AlarmSample& sample) override { return Keep(alarms, sample); }
  Sent Write(const ReplySample& reply) override { return Keep(replies, reply); }
  void OnRequest(TakeRequest take) override { on_request = std::move(take); }
  bool WaitAcknowledged(Duration) override { return true; }
  Sent Reopen(const Room& room) override {
    if (answer == Sent::yes) reopened.push_back(room);
    return answer;
  }
  Subscribers subscribers() const override { return there; }
  DatagramCounters datagrams() const override { return counted; }

  const PointSample* Latest(const std::string& point) const {
    const auto at = std::find_if(points.rbegin(), points.rend(),
                                 [&](const PointSample& s) { return s.point == point; });
    return at == points.rend() ? nullptr : &*at;
  }

  std::vector<PointSample> points;
  std::vector<DeviceSample> devices;
  std::vector<GatewaySample> gateways;
  std::vector<EventSample> events;
  std::vector<AlarmSample> alarms;
  std::vector<ReplySample> replies;
  std::vector<Room> reopened;
  Subscribers there{.events = 1};
  TakeRequest on_request;
  DatagramCounters counted;
  int asked = 0;
  Sent answer = Sent::yes;  ///< answer to each Write; only with `yes` the sample is recorded

 private:
  template <typename T>
  Sent Keep(std::vector<T>& list, const T& entry) {
    ++asked;
    if (answer == Sent::yes) list.push_back(entry);
    return answer;
  }
};

}  // namespace baudgate::dds::testing
