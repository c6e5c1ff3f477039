// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/trace/line_recorder.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr std::size_t kMostText = 256;  // of a reason or note
constexpr std::size_t kMostNotes = 32;  // of an exchange, beyond its pieces

char Shown(std::uint8_t byte) {
  return byte >= 0x20 && byte < 0x7F ? static_cast<char>(byte) : '.';
}

/// Which bytes of the request are secret.
std::vector<bool> MaskOf(const Request& request) {
  std::vector<bool> mask(request.bytes.size());
  for (const auto& [at, count] : request.expect.secrets) {
    for (std::size_t i = at; i - at < count && i < mask.size(); ++i) mask[i] = true;
  }
  return mask;
}

}  // namespace

LineRecorder::LineRecorder(const config::Line& line, std::uint32_t first_device, Sink sink)
    : line_(line), first_device_(first_device), sink_(std::move(sink)) {}

void LineRecorder::Exchange::Clear() {
  items.clear();
  bytes.clear();
  masked.clear();
  on_wire = left_out = 0;
}

void LineRecorder::Exchange::Keep(Item item, View content) {
  item.begin = static_cast<std::uint16_t>(bytes.size());
  Append(bytes, content);
  item.end = static_cast<std::uint16_t>(bytes.size());
  const bool goes_on = item.kind == TraceRecord::Kind::received && items.size() >= kMostItems &&
                       items.back().kind == TraceRecord::Kind::received;
  if (goes_on) {
    items.back().end = item.end;
  } else {
    items.push_back(item);
  }
}

// ---------------------------------------------------------------- from the line

void LineRecorder::OnSent(std::uint32_t device, const Request& request, Now now) {
  const MutexLock lock(mutex_);
  Begin();
  asked_ = device;
  masks_received_ = !request.expect.secrets.empty();
  if (masks_received_) last_secret_ = now.instant;
  AddBytes({.kind = TraceRecord::Kind::sent, .device = device, .at = now.wall}, request.bytes,
           masks_received_ ? MaskOf(request) : std::vector<bool>());
}

void LineRecorder::OnReceived(View bytes, Now now) {
  const MutexLock lock(mutex_);
  BeginUnasked(now);
  AddBytes({.kind = TraceRecord::Kind::received, .device = asked_, .at = now.wall}, bytes,
           std::vector<bool>(masks_received_ ? bytes.size() : 0, true));
}

void LineRecorder::OnExchangeEnd(std::uint32_t device, const ExchangeEnd& end, Now now) {
  std::optional<Recording> recording;
  {
    const MutexLock lock(mutex_);
    asked_ = kNoDevice;
    ended_ = now.instant;
    Item item{.kind = TraceRecord::Kind::end, .outcome = end.outcome, .device = device};
    item.at = now.wall;
    item.round_trip = end.round_trip;
    Add(item, IsQuotable(now) ? end.reason : std::string());
    if (end.outcome == Outcome::corrupt) recording = Save(device, "corrupt", now);
  }
  if (recording) sink_(std::move(*recording));
}

void LineRecorder::OnDeviceState(std::uint32_t device, DeviceState to, const std::string& reason,
                                 Now now) {
  std::optional<Recording> recording;
  {
    const MutexLock lock(mutex_);
    const bool quotable = !reason.empty() && IsQuotable(now);
    Add({.device = device, .at = now.wall},
        std::string(Name(to)) + (quotable ? ": " + reason : std::string()));
    if (to == DeviceState::offline) recording = Save(device, "offline", now);
  }
  if (recording) sink_(std::move(*recording));
}

void LineRecorder::OnPort(const std::string& text, Now now) {
  const MutexLock lock(mutex_);
  asked_ = kNoDevice;
  Add({.at = now.wall}, text);
}

bool LineRecorder::IsQuotable(Now now) const {
  return !last_secret_ || now.instant - *last_secret_ > kNoReasons;
}

// ---------------------------------------------------------------- the ring

LineRecorder::Exchange& LineRecorder::Begin() {
  newest_ = (newest_ + 1) % kExchanges;
  count_ = std::min(count_ + 1, kExchanges);
  ring_[newest_].Clear();
  return ring_[newest_];
}

void LineRecorder::BeginUnasked(Now now) {
  const auto last = std::exchange(received_, now.instant);
  const bool asks = asked_ != kNoDevice || (ended_ && now.instant - *ended_ < kOnlyListens);
  if (count_ == 0 || asks) return;
  const bool silent = !last || now.instant - *last >= kSilence;
  if (silent || ring_[newest_].on_wire >= kMostBytes) Begin();
}

void LineRecorder::Add(const Item& item, std::string_view text) {
  const View content(reinterpret_cast<const std::uint8_t*>(text.data()),
                     std::min(text.size(), kMostText));
  if (!readers_.empty()) Tell(Show(item, content, {}));
  // Notes of a line that is never asked anything must not add up.
  Exchange& exchange = Current();
  if (exchange.items.size() < kMostItems + kMostNotes) exchange.Keep(item, content);
}

void LineRecorder::AddBytes(const Item& item, View bytes, const std::vector<bool>& masked) {
  if (!readers_.empty()) Tell(Show(item, bytes, masked));
  Exchange& exchange = Current();
  const View kept = bytes.first(std::min(bytes.size(), kMostBytes - exchange.on_wire));
  exchange.left_out += bytes.size() - kept.size();
  if (kept.empty()) return;
  const std::size_t begin = exchange.bytes.size();
  exchange.on_wire += kept.size();
  exchange.Keep(item, kept);
  for (std::size_t i = 0; i < kept.size() && i < masked.size(); ++i) {
    if (!masked[i]) continue;
    exchange.masked.resize(exchange.bytes.size());
    exchange.masked[begin + i] = true;
    exchange.bytes[begin + i] = 0;
  }
}

TraceRecord LineRecorder::Show(const Item& item, View content,
                               const std::vector<bool>& masked) const {
  TraceRecord record;
  record.kind = item.kind;
  record.at = item.at;
  if (item.device != kNoDevice) record.device = NameOf(item.device);
  record.outcome = item.outcome;
  record.round_trip = item.round_trip;
  if (item.kind == TraceRecord::Kind::end || item.kind == TraceRecord::Kind::note) {
    record.text = AsText(content);
    return record;
  }
  for (std::size_t i = 0; i < content.size(); ++i) {
    const bool secret = i < masked.size() && masked[i];
    if (i > 0) record.hex += ' ';
    record.hex += secret ? "**" : HexByte(content[i]);
    record.text += secret ? '*' : Shown(content[i]);
  }
  return record;
}

std::vector<TraceRecord> LineRecorder::Copy() const {
  std::vector<TraceRecord> records;
  for (std::size_t i = 0; i < count_; ++i) {
    const Exchange& exchange = ring_[(newest_ + kExchanges - count_ + 1 + i) % kExchanges];
    for (const Item& item : exchange.items) {
      std::vector<bool> masked;
      for (std::size_t at = item.begin; at < item.end && at < exchange.masked.size(); ++at) {
        masked.push_back(exchange.masked[at]);
      }
      const View content = View(exchange.bytes).subspan(item.begin, item.end - item.begin);
      records.push_back(Show(item, content, masked));
    }
    if (exchange.left_out == 0) continue;
    TraceRecord note;
    note.at = exchange.items.back().at;
    note.text = "… " + std::to_string(exchange.left_out) + " more bytes";
    records.push_back(std::move(note));
  }
  return records;
}

std::optional<Recording> LineRecorder::Save(std::uint32_t device, const char* reason, Now now) {
  if (!sink_ || (saved_ && now.instant - *saved_ < kBetweenRecordings)) return std::nullopt;
  saved_ = now.instant;
  const config::Device* known =
      device >= kFirstSlave ? nullptr : &line_.devices[device - first_device_];
  return Recording{&line_, known, NameOf(device), reason, now.wall, Copy()};
}

std::string LineRecorder::NameOf(std::uint32_t device) const {
  return device >= kFirstSlave ? SlaveName(device) : line_.devices[device - first_device_].name;
}

// ---------------------------------------------------------------- readers

void LineRecorder::Tell(const TraceRecord& record) {
  std::erase_if(readers_, [&](const std::weak_ptr<TraceQueue>& reader) {
    const auto queue = reader.lock();
    if (queue) queue->Push(record);
    return !queue;
  });
}

std::shared_ptr<TraceQueue> LineRecorder::Subscribe(std::function<void()> wake) {
  auto queue = std::make_shared<TraceQueue>(std::move(wake));
  const MutexLock lock(mutex_);
  readers_.push_back(queue);
  return queue;
}

std::vector<TraceRecord> LineRecorder::Recorded() const {
  const MutexLock lock(mutex_);
  return Copy();
}

}  // namespace baudgate
