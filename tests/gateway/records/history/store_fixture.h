// `ValueStoreTest`: the files of a history of two points, in a folder of the test.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/records/history/history_log.h"
#include "gateway/records/history/history_view.h"
#include "tests/gateway/records/history/folder.h"

namespace baudgate::history {

inline constexpr Millis kBegin = 1'790'000'000'000 / kDay * kDay;

inline Now At(Millis time, Millis ahead = 0) {
  return {Instant(std::chrono::milliseconds(time)), ToWall(time + ahead)};
}

class ValueStoreTest : public FolderTest {
 protected:
  std::unique_ptr<ValueStore> Open(Millis now, StoreLimits limits = {}) {
    const std::vector<PointName> names = {{"bay.f1.a", config::Type::float32},
                                          {"bay.f1.on", config::Type::boolean}};
    auto store = std::make_unique<ValueStore>(folder(), names, limits);
    const Status status = store->Open(At(now));
    EXPECT_TRUE(status) << status.error();
    return store;
  }
  static Batch Seconds(std::int64_t run, Millis from, Millis to, RunBegin why = RunBegin::started,
                       std::optional<Millis> began = {}) {
    Batch batch;
    batch.runs = {{run, began.value_or(from), to, why}};
    for (Millis time = from; time < to; time += kSecond) {
      batch.samples.push_back(
          {0, run, {time, static_cast<double>(time / kSecond % 1000) / 10, Quality::good}});
      batch.samples.push_back({1, run, {time, time / kSecond % 2 == 0, Quality::good}});
    }
    return batch;
  }
  std::vector<HistoryRecord> All(PageQuery query) const {
    std::vector<HistoryRecord> records;
    for (;;) {
      const auto page = ReadPage(folder(), query);
      EXPECT_TRUE(page) << page.error();
      if (!page) return records;
      records.insert(records.end(), page->records.begin(), page->records.end());
      query.after = page->next;
      if (!page->more) return records;
    }
  }
};

}  // namespace baudgate::history
