// Values that were kept, as a table: which points are meant, and how it fits a terminal.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/history.h"

#include <gmock/gmock.h>

#include <sstream>

#include "gateway/records/history/history_view.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::HasSubstr;

/// One value of each point that is asked for.
struct OneValueEach final : history::HistorySource {
  history::HistoryState state() const override {
    history::HistoryState state;
    state.disk = Disk::fine;
    return state;
  }
  Result<history::Page> Read(const history::PageQuery&) const override {
    history::Page page;
    page.known = true;
    page.records.emplace_back().entry = {history::ToMillis(kNow.wall), 1.5, Quality::good};
    return page;
  }
  Result<history::TrendPage> ReadTrends(const history::TrendQuery&) const override {
    return history::TrendPage();
  }
};

class HistoryClient : public ControlTest {
 protected:
  HistoryClient() {
    config_.history.points = {{.device = 0, .point = 0}, {.device = 1, .point = 0}};
    GatewayInfo info{"1.2.3", kStarted};
    info.history = std::make_shared<OneValueEach>();
    StartServerWith(info);
  }
  int Run(std::vector<std::string> points, std::size_t width = 0) {
    out_.str({});
    return RunHistory({.points = std::move(points), .socket = path(), .width = width}, out_, err_);
  }

  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(HistoryClient, PatternsMeanThePointsThatAreKept) {
  EXPECT_EQ(Run({"*.*.curr*", "bay-1.feeder-1.current"}), 0) << err_.str();
  EXPECT_EQ(
      out_.str(),
      "time                      point                                        value  quality\n"
      "2026-09-21T14:13:20.000Z  bay-1.feeder-1.current                         1.5  good\n"
      "2026-09-21T14:13:20.000Z  bay-1.feeder-2.current                         1.5  good\n");
}

TEST_F(HistoryClient, PatternsThatMeanNothingSayWhy) {
  EXPECT_EQ(Run({"bay-1.*.power"}), 2);
  EXPECT_THAT(err_.str(), HasSubstr("no point is like 'bay-1.*.power'"));
  EXPECT_EQ(Run({"*.*.voltage"}), 2);
  EXPECT_THAT(err_.str(), HasSubstr("no value of a point like '*.*.voltage' is kept"));
}

TEST_F(HistoryClient, FitsATerminal) {
  EXPECT_EQ(Run({"bay-1.feeder-1.current"}, 60), 0);
  EXPECT_EQ(out_.str(),
            "time                      point                   value\n"
            "    quality\n"
            "2026-09-21T14:13:20.000Z  bay-1.feeder-1.current    1.5\n"
            "    good\n");
}

}  // namespace
}  // namespace baudgate::control
