// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/publishers.h"

namespace baudgate {
namespace {

using Weight = Remark::Weight;

std::int64_t StartOf(const std::map<dds::PublisherId, std::int64_t>& starts,
                     const dds::PublisherId& publisher) {
  const auto at = starts.find(publisher);
  return at == starts.end() ? 0 : at->second;
}

std::string TwoWriters(const std::string& gateway, const std::string& point,
                       const dds::PublisherId& first, const dds::PublisherId& second) {
  return "ALARM: gateway " + gateway + ": " + point + " has two live writers, " + Text(first) +
         " and " + Text(second) + "; one of them may be false";
}

}  // namespace

void Publishers::OnSample(const dds::PointSample& sample, const dds::Origin& origin, Instant now) {
  const dds::PublisherId& publisher = origin.writer.publisher;
  Names& of = *gateways_.try_emplace(sample.gateway).first;
  Gateway& gateway = of.second;
  if (!gateway.current) {
    gateway.current = publisher;
    Say(Weight::note, "gateway " + sample.gateway + " is published by " + Text(publisher));
  } else if (!gateway.live.contains(*gateway.current) && *gateway.current != publisher) {
    TookOver(of, *gateway.current, publisher);
  }
  gateway.live[publisher] = origin.received;
  const auto& rivals = gateway.rivals;
  if (rivals && !rivals->alarm && publisher == rivals->first && origin.received > rivals->since) {
    Alarm(of);
  }
  const std::int64_t start = StartOf(gateway.starts, publisher);
  const auto [at, added] = points_.try_emplace({sample.gateway, sample.device, sample.point});
  Point& point = at->second;
  if (!added && point.publisher == publisher) {
    CheckSeq(of, point, sample, start);
  } else if (!added) {
    CheckRivals(of, point, publisher, sample.device + " " + sample.point, origin.received, now);
  }
  point = {publisher, sample.seq, start};
}

void Publishers::OnStart(const dds::GatewaySample& start, const dds::PublisherId& publisher) {
  Names& of = *gateways_.try_emplace(start.gateway).first;
  Gateway& gateway = of.second;
  std::int64_t& known = gateway.starts[publisher];
  if (known == start.start_time_ns) return;
  known = start.start_time_ns;
  gateway.counted_back.clear();
  Say(Weight::note, "gateway " + start.gateway + " of " + Text(publisher) + " was started at " +
                        FormatWallTime(WallTime(Duration(known))) + ", version " + start.version);
  const auto& rivals = gateway.rivals;
  if (rivals && !rivals->alarm && StartedLater(gateway, rivals->second, rivals->first)) {
    TookOver(of, rivals->first, rivals->second);
  }
}

void Publishers::OnLeft(const dds::PublisherId& publisher) {
  for (Names& of : gateways_) {
    Gateway& gateway = of.second;
    gateway.live.erase(publisher);
    gateway.starts.erase(publisher);
    if (!gateway.rivals) continue;
    const Rivals rivals = *gateway.rivals;
    if (publisher == rivals.first) {
      TookOver(of, rivals.first, rivals.second);
    } else if (publisher == rivals.second) {
      gateway.rivals.reset();
      Say(Weight::change, "gateway " + of.first + ": " + Text(publisher) + " has left, " +
                              Text(rivals.first) + " remains");
    }
  }
}

void Publishers::OnDeaf() {
  for (auto& [name, gateway] : gateways_) {
    gateway.live.clear();
    gateway.starts.clear();
    gateway.rivals.reset();
  }
}

void Publishers::Tick(Instant now) {
  for (Names& of : gateways_) {
    const auto& rivals = of.second.rivals;
    if (rivals && !rivals->alarm && now >= rivals->judged_at) Alarm(of);
  }
}

std::vector<std::string> Publishers::Alarms() const {
  std::vector<std::string> alarms;
  for (const auto& [name, gateway] : gateways_) {
    const auto& rivals = gateway.rivals;
    if (rivals && rivals->alarm) {
      alarms.push_back(TwoWriters(name, rivals->point, rivals->first, rivals->second));
    }
    if (!gateway.counted_back.empty()) alarms.push_back(gateway.counted_back);
  }
  return alarms;
}

void Publishers::Say(Weight weight, std::string text) {
  remarks_.push_back({weight, std::move(text)});
}

void Publishers::Alarm(Names& of) {
  Rivals& rivals = *of.second.rivals;
  rivals.alarm = true;
  Say(Weight::alarm, TwoWriters(of.first, rivals.point, rivals.first, rivals.second));
}

void Publishers::TookOver(Names& of, dds::PublisherId first, dds::PublisherId second) {
  of.second.current = second;
  of.second.rivals.reset();
  Say(Weight::change,
      "gateway " + of.first + ": " + Text(second) + " took over from " + Text(first));
}

void Publishers::CheckRivals(Names& of, const Point& before, const dds::PublisherId& publisher,
                             const std::string& point, WallTime received, Instant now) {
  Gateway& gateway = of.second;
  if (gateway.rivals || !gateway.live.contains(before.publisher)) return;
  if (StartedLater(gateway, publisher, before.publisher)) {
    if (gateway.current != publisher) TookOver(of, before.publisher, publisher);
    return;
  }
  gateway.rivals = Rivals{before.publisher, publisher, received, now + kRivalsMayGo, point};
}

/// Without any reading a point is new: a reload has restarted its line.
void Publishers::CheckSeq(Names& of, const Point& before, const dds::PointSample& sample,
                          std::int64_t start) {
  if (sample.seq == 0 || sample.seq >= before.seq || start != before.start ||
      !of.second.counted_back.empty())
    return;
  of.second.counted_back = "ALARM: gateway " + of.first + ": seq of " + sample.device + " " +
                           sample.point + " went back from " + std::to_string(before.seq) + " to " +
                           std::to_string(sample.seq) + " without a new start of the gateway";
  Say(Weight::alarm, of.second.counted_back);
}

bool Publishers::StartedLater(const Gateway& gateway, const dds::PublisherId& second,
                              const dds::PublisherId& first) {
  const std::int64_t known = StartOf(gateway.starts, first);
  return known != 0 && StartOf(gateway.starts, second) > known;
}

}  // namespace baudgate
