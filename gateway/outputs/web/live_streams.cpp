// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/live_streams.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "gateway/outputs/status/records_json.h"
#include "gateway/outputs/web/points_json.h"

namespace baudgate::web {

void Frames::Push(std::string text) {
  auto made = std::make_shared<const std::string>(std::move(text));
  const MutexLock lock(mutex_);
  bytes_ += made->size();
  frames_.push_back(std::move(made));
  while (frames_.size() > 1 && (frames_.size() > kMostFrames || bytes_ > kMostBytes)) {
    bytes_ -= frames_.front()->size();
    frames_.pop_front();
    ++first_;
  }
  if (snapshot_ && after_snapshot_ < first_) snapshot_.reset();
}

void Frames::SetSnapshot(std::string text) {
  auto made = std::make_shared<const std::string>(std::move(text));
  const MutexLock lock(mutex_);
  snapshot_ = std::move(made);
  after_snapshot_ = first_ + frames_.size();
  wanted_ = false;
}

void Frames::End(std::string farewell) {
  Push(std::move(farewell));
  const MutexLock lock(mutex_);
  ended_ = true;
}

bool Frames::wants_snapshot() const {
  const MutexLock lock(mutex_);
  return wanted_;
}

Frames::Next Frames::Take(std::uint64_t& position) {
  const MutexLock lock(mutex_);
  if (position < first_) {
    if (ended_) {
      position = first_ + frames_.size();
      return {frames_.back(), false};
    }
    if (!snapshot_) {
      wanted_ = true;
      return {};
    }
    position = after_snapshot_;
    return {snapshot_, false};
  }
  if (position >= first_ + frames_.size()) return {nullptr, ended_};
  return {frames_[position++ - first_], false};
}

namespace {

std::string Event(std::string_view name, std::string_view data) {
  return fmt::format("event: {}\ndata: {}\n\n", name, data);
}

std::int64_t InMilliseconds(WallTime time) {
  return std::chrono::floor<std::chrono::milliseconds>(time).time_since_epoch().count();
}

}  // namespace

class LivePoints::Viewer final : public Stream {
 public:
  explicit Viewer(std::shared_ptr<Frames> frames) : frames_(std::move(frames)) {}

  std::ptrdiff_t Read(std::span<char> into) override {
    if (!text_ || sent_ == text_->size()) {
      Frames::Next next = frames_->Take(position_);
      if (next.ended) return kEnd;
      text_ = std::move(next.text);
      sent_ = 0;
      if (!text_) return 0;
    }
    const std::size_t bytes = std::min(into.size(), text_->size() - sent_);
    std::memcpy(into.data(), text_->data() + sent_, bytes);
    sent_ += bytes;
    return static_cast<std::ptrdiff_t>(bytes);
  }
  void SetWake(std::function<void()> wake) override {
    const MutexLock lock(mutex_);
    wake_ = std::move(wake);
  }
  void Wake() {
    std::function<void()> wake;
    {
      const MutexLock lock(mutex_);
      wake = wake_;
    }
    if (wake) wake();
  }

 private:
  const std::shared_ptr<Frames> frames_;
  std::uint64_t position_ = 0;
  Frames::Text text_;  // null: there is no next frame yet
  std::size_t sent_ = 0;
  Mutex mutex_;
  std::function<void()> wake_ BAUDGATE_GUARDED_BY(mutex_);
};

std::shared_ptr<Stream> LivePoints::Join(Device device, Now now) {
  if (!channels_.contains(device) && channels_.size() >= kMostKinds) return nullptr;
  if (!feed_) {
    feed_ = store_.Subscribe();
    next_beat_ = now.instant + kBeat;
    alarms_ = CountAlarms();
  }
  const bool is_new = !channels_.contains(device);
  Channel& channel = channels_[device];
  auto viewer = std::make_shared<Viewer>(channel.frames);
  channel.viewers.push_back(viewer);
  if (is_new) channel.frames->SetSnapshot(Snapshot(device, now));
  return viewer;
}

bool LivePoints::Tick(Now now) {
  for (auto& [device, channel] : channels_) {
    std::erase_if(channel.viewers, [](const auto& viewer) { return viewer.expired(); });
  }
  std::erase_if(channels_, [](const auto& entry) { return entry.second.viewers.empty(); });
  if (channels_.empty()) {
    Drop();
    return false;
  }
  feed_->Drain(Instant{}, changes_);
  // The points are sorted by device, so that each device is read only once.
  std::ranges::stable_sort(changes_.points, {}, &bus::PointRef::device);
  std::string common;
  const AlarmCounts alarms = CountAlarms();
  if (std::exchange(alarms_, alarms) != alarms) common += AlarmsEvent();
  if (now.instant >= next_beat_) {
    next_beat_ = now.instant + kBeat;
    common += Event("beat", fmt::format("{{\"time_ms\":{}}}", InMilliseconds(now.wall)));
  }
  for (auto& [device, channel] : channels_) {
    std::string frame = Changed(device, now) + common;
    const bool any = !frame.empty();
    if (any) channel.frames->Push(std::move(frame));
    const bool anew = channel.frames->wants_snapshot();
    if (anew) channel.frames->SetSnapshot(Snapshot(device, now));
    if (any || anew) Wake(channel);
  }
  return true;
}

void LivePoints::EndAll() {
  for (auto& [device, channel] : channels_) {
    channel.frames->End(Event("reload", "{}"));
    Wake(channel);
  }
  ++generation_;
  Drop();
}

void LivePoints::Drop() {
  channels_.clear();
  if (feed_) store_.Unsubscribe(feed_);
  feed_.reset();
}

void LivePoints::Wake(Channel& channel) {
  for (const auto& weak : channel.viewers) {
    if (const auto viewer = weak.lock()) viewer->Wake();
  }
}

std::string LivePoints::Snapshot(Device only, Now now) {
  const PointNumbers numbers(store_);
  std::string data = fmt::format("{{\"time_ms\":{},\"generation\":{},\"values\":[",
                                 InMilliseconds(now.wall), generation_);
  for (std::uint32_t device = 0; device < store_.device_count(); ++device) {
    if (store_.gone(device) || (only && *only != device)) continue;
    bus::DeviceRecord record;
    store_.Read(device, [&](const bus::DeviceRecord& held) { record = held; });
    for (std::uint32_t i = 0; i < record.points.size(); ++i) {
      AppendRow(record, i, numbers.Of(device, i), now.instant, data);
    }
  }
  if (data.back() == ',') data.pop_back();
  return Event("snapshot", data + "]}") + AlarmsEvent() +
         Event("beat", fmt::format("{{\"time_ms\":{}}}", InMilliseconds(now.wall)));
}

std::string LivePoints::Changed(Device only, Now now) {
  const PointNumbers numbers(store_);
  std::string rows;
  std::optional<std::uint32_t> read;
  bus::DeviceRecord record;
  for (const bus::PointRef& ref : changes_.points) {
    if ((only && *only != ref.device) || store_.gone(ref.device)) continue;
    if (read != ref.device) {
      record.points.clear();
      store_.Read(ref.device, [&](const bus::DeviceRecord& held) { record = held; });
      read = ref.device;
    }
    if (record.points.empty()) continue;  // the device was removed from the store
    AppendRow(record, ref.point, numbers.Of(ref.device, ref.point), now.instant, rows);
  }
  if (rows.empty()) return {};
  rows.pop_back();
  return Event("change", fmt::format("{{\"time_ms\":{},\"generation\":{},\"values\":[{}]}}",
                                     InMilliseconds(now.wall), generation_, rows));
}

LivePoints::AlarmCounts LivePoints::CountAlarms() const {
  if (events_ == nullptr) return {};
  const events::EventsState state = events_->state();
  return {state.alarms_active, state.alarms_unacknowledged, state.newest};
}

/// Returns the event with the numbers of alarms and the worst alarm.
std::string LivePoints::AlarmsEvent() const {
  using Json = nlohmann::ordered_json;
  std::vector<events::Alarm> alarms;
  if (events_ != nullptr) alarms = events_->Alarms();
  const auto count = [&](auto is) {
    return std::ranges::count_if(alarms, is, &events::Alarm::state);
  };
  const Json json = {{"active", count(events::IsActive)},
                     {"unacknowledged", count(events::IsUnacknowledged)},
                     {"worst", status::WorstJson(alarms)}};
  return Event("alarms", json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::ptrdiff_t LiveTrace::Read(std::span<char> into) {
  if (sent_ == text_.size()) {
    if (ended_) return kEnd;
    text_.clear();
    sent_ = 0;
    const std::vector<records::TraceRecord> records = queue_->Take();
    for (const records::TraceRecord& record : records) Append(frames_.Take(ToText(record)));
    if (beat_.exchange(false)) {
      // No record has arrived for a beat (1 s). Pauses within a frame are shorter, so the frame
      // that still waits is complete.
      if (records.empty() && frames_.waits()) Append(frames_.Flush());
      text_ += "event: beat\ndata: {}\n\n";
    }
  }
  const std::size_t bytes = std::min(into.size(), text_.size() - sent_);
  std::memcpy(into.data(), text_.data() + sent_, bytes);
  sent_ += bytes;
  return static_cast<std::ptrdiff_t>(bytes);
}

void LiveTrace::Append(const std::vector<std::string>& frames) {
  for (const std::string& frame : frames) {
    text_ += "event: record\ndata: {\"record\":" + JsonText(frame) + "}\n\n";
  }
}

void LiveTrace::SetWake(std::function<void()> wake) {
  const MutexLock lock(mutex_);
  wake_ = std::move(wake);
}

void LiveTrace::Wake() {
  std::function<void()> wake;
  {
    const MutexLock lock(mutex_);
    wake = wake_;
  }
  if (wake) wake();
}

void LiveTrace::Beat() {
  beat_ = true;
  Wake();
}

void LiveTrace::End() {
  ended_ = true;
  Wake();
}

}  // namespace baudgate::web
