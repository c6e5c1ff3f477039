// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/event_keeper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace baudgate::protocols {

EventKeeper::EventKeeper(const std::vector<std::string>& devices) {
  for (const std::string& device : devices) names_.emplace_back("line", device);
}

void EventKeeper::Begin(int power_left) {
  disk_.power_left = -1;
  book_ = std::make_unique<events::EventBook>();
  {
    events::EventFile file(audit::kEventsFile, disk_.vfs());
    const auto opened = file.Open();
    ASSERT_TRUE(opened && opened->ok);
    EXPECT_TRUE(opened->put_aside.empty()) << opened->put_aside;
    said_ = opened->contents.said;
    owed_ = opened->contents.owed;
  }
  file_ = std::make_unique<events::EventFile>(audit::kEventsFile, disk_.vfs());
  disk_.power_left = power_left;
}

void EventKeeper::End(std::mt19937& random) {
  file_.reset();
  feed_.reset();
  waiting_.clear();
  if (disk_.power_failed()) disk_.Restore(random);
}

std::string EventKeeper::Said(std::uint32_t device) const {
  const auto found = said_.find(names_[device]);
  return found == said_.end() ? std::string() : found->second;
}

bool EventKeeper::Keep(const bus::ReportedEvents& reported, const config::Device& device) {
  if (waiting_.insert(reported.device).second) {
    asked_again += reported.batch.again ? 1 : 0;
    events::Batch batch{
        reported.device, reported.batch.said, reported.batch.again,
        events::RecordsOf(reported.batch, "line", device, reported.received.wall, reported.oldest)};
    std::tie(batch.line, batch.device) = names_[reported.device];
    book_->Add(std::move(batch));
  }
  return Write() && waiting_.count(reported.device) == 0;
}

bool EventKeeper::Open() {
  auto opened = file_->Open();
  if (!opened) return true;
  if (!opened->ok) return false;
  EXPECT_TRUE(opened->put_aside.empty()) << opened->put_aside;
  book_->OnOpened(opened->contents.last, opened->contents.said);
  if (!feed_) return true;
  cursors_->OnOpened(opened->contents.cursors);
  feed_->Begin(std::move(opened->contents.image));
  return true;
}

bool EventKeeper::Write() {
  if (!Open()) return false;
  const auto due = book_->Prepare();
  const auto cursors = feed_ ? cursors_->Due() : std::nullopt;
  if (!file_->Write(due, cursors ? &*cursors : nullptr)) return false;
  for (const events::Batch& batch : due) {
    for (const events::EventRecord& event : batch.events) {
      if (event.record.empty()) continue;
      owed_.push_back(
          {event.seq, event.line, event.device, event.record, event.device_time, event.clock});
    }
  }
  if (cursors) cursors_->OnKept(*cursors);
  if (feed_) {
    std::vector<events::EventRecord> fed;
    for (const events::Batch& batch : due) {
      fed.insert(fed.end(), batch.events.begin(), batch.events.end());
    }
    feed_->Add(std::move(fed));
  }
  for (const auto& name : book_->Kept(due.size())) {
    waiting_.erase(static_cast<std::uint32_t>(std::ranges::find(names_, name) - names_.begin()));
  }
  return true;
}

void EventKeeper::SetFeed(std::shared_ptr<events::EventFeed> feed,
                          std::shared_ptr<events::CursorBook> cursors) {
  feed_ = std::move(feed);
  cursors_ = std::move(cursors);
  feed_->Renumber(names_);
  feed_->ServeWith([] {});
}

bool EventKeeper::Serve() {
  if (!Write()) return false;
  while (const auto after = feed_->wanted()) {
    auto events = file_->ReadBehind(*after);
    if (!events) return false;
    feed_->Supply(*after, std::move(*events));
  }
  return true;
}

bool EventKeeper::Keep(const events::KeptRecord& record) {
  if (const auto opened = file_->Open()) {
    if (!opened->ok) return false;
    book_->OnOpened(opened->contents.last, opened->contents.said);
  }
  return file_->Write({}, nullptr, {record}).ok();
}

std::vector<events::KeptRecord> EventKeeper::ReadRecords() {
  records::Database database(audit::kEventsFile, records::Database::Mode::write, disk_.vfs());
  auto records = events::ReadRecordsOf(database, 1, std::numeric_limits<std::int64_t>::max());
  EXPECT_TRUE(records) << records.error();
  if (!records) return {};
  return std::move(*records);
}

std::vector<events::EventRecord> EventKeeper::ReadAll() {
  records::Database database(audit::kEventsFile, records::Database::Mode::write, disk_.vfs());
  std::vector<events::EventRecord> all;
  events::PageQuery query;
  for (bool more = true; more;) {
    const auto page = ReadPage(database, query);
    EXPECT_TRUE(page) << page.error();
    if (!page) break;
    all.insert(all.end(), page->records.begin(), page->records.end());
    query.after = page->next;
    more = page->more;
  }
  std::int64_t seq = 0;
  for (const events::EventRecord& record : all) EXPECT_EQ(record.seq, ++seq) << "without a gap";
  return all;
}

}  // namespace baudgate::protocols
