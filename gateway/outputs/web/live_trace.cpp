// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/live_trace.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "gateway/outputs/web/points_json.h"

namespace baudgate::web {

std::ptrdiff_t LiveTrace::Read(std::span<char> into) {
  if (sent_ == text_.size()) {
    if (ended_) return kEnd;
    text_.clear();
    sent_ = 0;
    const std::vector<TraceRecord> records = queue_->Take();
    for (const TraceRecord& record : records) Append(frames_.Take(ToText(record)));
    if (beat_.exchange(false)) {
      // A beat is longer than what belongs together is apart.
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
