// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_book.h"

#include <algorithm>
#include <utility>

namespace baudgate::events {

void EventBook::Add(Batch batch) { waiting_.push_back(std::move(batch)); }

void EventBook::OnOpened(std::int64_t last, const std::map<Source, std::string>& said) {
  last_ = std::max(last_, last);
  said_.insert(said.begin(), said.end());
}

std::string EventBook::said(Source source) const {
  const auto found = said_.find(source);
  return found == said_.end() ? std::string() : found->second;
}

bool EventBook::IsRepeat(const Batch& batch, const std::map<Source, std::string>& said) const {
  const auto found = said.find(batch.source);
  return batch.again && found != said.end() && found->second == batch.said;
}

std::vector<Batch> EventBook::Due() {
  std::vector<Batch> due(waiting_.begin(), waiting_.end());
  std::map<Source, std::string> said = said_;
  std::int64_t seq = last_;
  for (Batch& batch : due) {
    if (IsRepeat(batch, said)) batch.events.clear();
    for (EventRecord& event : batch.events) event.seq = ++seq;
    said[batch.source] = batch.said;
  }
  return due;
}

std::vector<Source> EventBook::Kept(std::size_t batches) {
  std::vector<Source> sources;
  for (; batches > 0; --batches) {
    Batch& batch = waiting_.front();
    const auto events = static_cast<std::int64_t>(batch.events.size());
    if (IsRepeat(batch, said_)) {
      repeats_ += batch.events.size();
    } else {
      last_ += events;
    }
    sources.push_back(batch.source);
    said_[batch.source] = std::move(batch.said);
    waiting_.pop_front();
  }
  return sources;
}

}  // namespace baudgate::events
