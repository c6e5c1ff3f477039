// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/point_image.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <string_view>

namespace baudgate::tools {
namespace {

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

/// Removes a run of digits, or one other character, from the front of `text`, and returns it
/// without leading zeros.
std::string_view TakeToken(std::string_view& text) {
  std::size_t end = 1;
  if (IsDigit(text.front())) {
    end = std::min(text.find_first_not_of("0123456789"), text.size());
  }
  std::string_view token = text.substr(0, end);
  text.remove_prefix(end);
  while (token.size() > 1 && token.front() == '0') token.remove_prefix(1);
  return token;
}

/// Compares names. Numbers in names are compared by value: "input_2" comes before "input_10".
bool ComesBefore(std::string_view a, std::string_view b) {
  std::string_view left = a;
  std::string_view right = b;
  while (!left.empty() && !right.empty()) {
    const std::string_view one = TakeToken(left);
    const std::string_view other = TakeToken(right);
    if (one == other) continue;
    const bool numbers = IsDigit(one.front()) && IsDigit(other.front());
    if (numbers && one.size() != other.size()) return one.size() < other.size();
    return one < other;
  }
  if (left.empty() != right.empty()) return left.empty();
  return a < b;
}

}  // namespace

PointOrder::PointOrder(std::istream& profiles) {
  std::set<std::string> readable;
  for (std::string line; std::getline(profiles, line);) {
    Places& places = profiles_.emplace_back();
    std::istringstream names(line);
    for (std::string name; names >> name;) {
      const bool write_only = name.front() == '-';
      if (write_only) name.erase(0, 1);
      places.emplace(name, places.size());
      (write_only ? write_only_ : readable).insert(name);
    }
  }
  for (const std::string& name : readable) write_only_.erase(name);
}

const PointOrder::Places* PointOrder::ProfileOf(const std::vector<std::string>& points) const {
  const Places* best = nullptr;
  // The number of matching points, then a number that is higher for profiles with fewer points.
  std::pair<std::size_t, std::size_t> most{0, 0};
  for (const Places& places : profiles_) {
    const auto has = static_cast<std::size_t>(std::ranges::count_if(
        points, [&](const std::string& point) { return places.contains(point); }));
    const std::pair fit{has, std::numeric_limits<std::size_t>::max() - places.size()};
    if (has == 0 || (best != nullptr && fit <= most)) continue;
    best = &places;
    most = fit;
  }
  return best;
}

void PointOrder::Sort(std::vector<std::string>& points) const {
  static const Places kNone;
  const Places* profile = ProfileOf(points);
  const Places& places = profile == nullptr ? kNone : *profile;
  const auto place = [&](const std::string& point) {
    const auto found = places.find(point);
    return found == places.end() ? places.size() : found->second;
  };
  std::ranges::sort(points, [&](const std::string& a, const std::string& b) {
    const std::size_t first = place(a);
    const std::size_t second = place(b);
    return first != second ? first < second : ComesBefore(a, b);
  });
}

namespace {

News Compare(const PointEvent& before, const PointEvent& now) {
  if (IsSameReading(before, now)) return News::nothing;
  return LooksAlike(before, now) ? News::reading : News::value;
}

}  // namespace

News PointImage::Put(const PointEvent& event) {
  const dds::PointSample& sample = event.sample;
  const auto [at, is_first] =
      image_.try_emplace({sample.gateway, sample.device, sample.point}, event);
  if (is_first) return News::point;
  const News news = Compare(at->second, event);
  at->second = event;
  return news;
}

std::vector<const PointEvent*> PointImage::Ordered() const {
  std::vector<const PointEvent*> ordered;
  for (auto first = image_.begin(); first != image_.end();) {
    const auto& [gateway, device, point] = first->first;
    std::vector<std::string> points;
    auto last = first;
    while (last != image_.end() && std::get<0>(last->first) == gateway &&
           std::get<1>(last->first) == device) {
      points.push_back(std::get<2>((last++)->first));
    }
    order_.Sort(points);
    for (const std::string& name : points) ordered.push_back(&image_.at({gateway, device, name}));
    first = last;
  }
  return ordered;
}

std::vector<PointRow> PointImage::Rows(WallTime now) const {
  const bool several =
      !image_.empty() && std::get<0>(image_.begin()->first) != std::get<0>(image_.rbegin()->first);
  std::vector<PointRow> rows;
  rows.reserve(image_.size());
  for (const PointEvent* event : Ordered()) {
    const dds::PointSample& sample = event->sample;
    PointRow row;
    row.device = several ? sample.gateway + "/" + sample.device : sample.device;
    row.point = sample.point;
    row.value = ValueText(sample);
    row.unit = sample.unit;
    row.quality = QualityOf(sample);
    if (sample.source_time_ns > 0) row.age = now - SourceTime(sample);
    row.gone = event->gone.has_value();
    rows.push_back(std::move(row));
  }
  return rows;
}

namespace {

using Weight = Remark::Weight;

std::int64_t StartOf(const std::map<dds::PublisherId, std::int64_t>& starts,
                     const dds::PublisherId& publisher) {
  const auto at = starts.find(publisher);
  return at == starts.end() ? 0 : at->second;
}

std::string TwoWriters(const std::string& gateway, const std::string& point,
                       const dds::PublisherId& first, const dds::PublisherId& second) {
  return "ALARM: gateway " + gateway + ": " + point + " comes from two senders at once, " +
         Text(first) + " and " + Text(second) + "; check that only one gateway has this name";
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
      Say(Weight::change, "gateway " + of.first + ": sender " + Text(publisher) +
                              " has stopped, and sender " + Text(rivals.first) + " continues");
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
      "gateway " + of.first + ": sender " + Text(second) + " took over from sender " + Text(first));
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

/// Reports readings whose numbers decrease. Ignores a sample with seq 0, which contains no reading,
/// for example after a reload has restarted its line.
void Publishers::CheckSeq(Names& of, const Point& before, const dds::PointSample& sample,
                          std::int64_t start) {
  if (sample.seq == 0 || sample.seq >= before.seq || start != before.start ||
      !of.second.counted_back.empty())
    return;
  of.second.counted_back = "ALARM: gateway " + of.first + ": the reading number (seq) of " +
                           sample.device + " " + sample.point + " went back from " +
                           std::to_string(before.seq) + " to " + std::to_string(sample.seq) +
                           " without a restart of the gateway";
  Say(Weight::alarm, of.second.counted_back);
}

bool Publishers::StartedLater(const Gateway& gateway, const dds::PublisherId& second,
                              const dds::PublisherId& first) {
  const std::int64_t known = StartOf(gateway.starts, first);
  return known != 0 && StartOf(gateway.starts, second) > known;
}

}  // namespace baudgate::tools
