// `EventLogTest`: an event log with its thread, on a disk that the test controls.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gateway/records/events/event_log.h"
#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/gateway/records/audit/fixture.h"

namespace baudgate::events {

class EventLogTest : public audit::FolderTest {
 protected:
  std::unique_ptr<EventLog> Start(const std::filesystem::path& path, const std::string& vfs = {},
                                  std::shared_ptr<records::EventsWriter> writer = {},
                                  bool tells_own = false) {
    EventLog::Options options;
    options.tells_own = tells_own;
    options.file = path;
    options.vfs = vfs;
    options.writer = std::move(writer);
    options.why_no_file = "there is no place for it";
    options.sources = {{"bay-1", "feeder-1"}, {"bay-1", "feeder-2"}};
    options.clocks = ReadClocks;
    options.feed = feed_;
    options.cursors = cursors_;
    options.watches = watches_;
    options.kept = [this](const std::vector<Source>& sources) {
      const std::lock_guard lock(mutex_);
      kept_ += sources.size();
    };
    options.owed = [this](const std::vector<OwedRecord>& owed) {
      const std::lock_guard lock(mutex_);
      for (const OwedRecord& one : owed) owed_.push_back(one.event);
    };
    options.alarm = [this](const Alarm& alarm, bool raised) {
      Hear("alarm", alarm.name + (raised ? " raised " : " ") + std::string(Name(alarm.state)));
    };
    options.warn = [this](const std::string& text) { Hear("warn", text); };
    options.inform = [this](const std::string& text) { Hear("inform", text); };
    return std::make_unique<EventLog>(std::move(options));
  }
  static Batch BatchOf(Source source, const std::string& said, bool again = false) {
    EventRecord record;
    record.received = record.device_time = audit::kWall;
    record.line = "bay-1";
    record.device = source == 0 ? "feeder-1" : "feeder-2";
    record.text = said;
    return {.source = source,
            .said = said,
            .again = again,
            .events = {record},
            .line = record.line,
            .device = record.device};
  }
  void Hear(const std::string& how, const std::string& text) {
    const std::lock_guard lock(mutex_);
    heard_.push_back(how + ": " + text);
  }
  std::vector<std::string> heard() {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  std::vector<std::int64_t> owed() {
    const std::lock_guard lock(mutex_);
    return owed_;
  }
  void AwaitKept(std::size_t count) {
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        if (kept_ >= count) return;
      }
      std::this_thread::yield();
    }
  }
  static std::vector<std::string> Texts(const EventLog& log) {
    const auto page = log.Read({});
    EXPECT_TRUE(page) << page.error();
    std::vector<std::string> texts;
    std::int64_t seq = 0;
    for (const EventRecord& record : page->records) {
      EXPECT_EQ(record.seq, ++seq);
      texts.push_back(record.text);
    }
    return texts;
  }

  std::vector<std::string> Fed() const {
    std::vector<std::string> texts;
    for (const FedEvent& event : feed_->Take(0, 100)) texts.push_back(event.record.text);
    return texts;
  }

  std::shared_ptr<EventFeed> feed_ = std::make_shared<EventFeed>();
  std::shared_ptr<CursorBook> cursors_ = std::make_shared<CursorBook>();
  Watched watches_;

 private:
  std::mutex mutex_;
  std::size_t kept_ = 0;
  std::vector<std::int64_t> owed_;
  std::vector<std::string> heard_;
};

}  // namespace baudgate::events
