// Billing readings as a table: of a gateway that keeps those of one meter.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <map>
#include <sstream>

#include "gateway/base/time.h"
#include "gateway/tools/cli/client/history.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct KeptReadings final : events::EventSource {
  events::EventsState state() const override {
    events::EventsState state;
    state.disk = Disk::fine;
    return state;
  }
  std::vector<events::Alarm> Alarms() const override { return {}; }
  std::size_t Acknowledge(const events::AckQuery&,
                          std::function<void(const events::Acknowledged&)>) override {
    return 0;
  }
  Result<events::Page> Read(const events::PageQuery&) const override { return events::Page(); }
  Result<events::PastPage> ReadPast(const events::PastQuery& query) const override {
    events::PastPage page;
    const auto found = rows.find(query.line + "." + query.device + "." + query.name);
    page.known = found != rows.end();
    if (!page.known) return page;
    for (const events::PastRow& row : found->second) {
      const bool since = !query.since || row.time >= *query.since;
      if (since && (!query.until || row.time < *query.until)) page.rows.push_back(row);
    }
    return page;
  }

  void Add(const std::string& name, const std::string& time, Value value,
           Quality quality = Quality::good) {
    rows[name].push_back({*ParseWallTime(time), {}, std::move(value), quality});
  }
  std::map<std::string, std::vector<events::PastRow>> rows;
};

class BillingTest : public ControlTest {
 protected:
  BillingTest() {
    // A meter at +03:00.
    for (const char* name : {"active_import", "active_export"}) {
      const std::string month = std::string("bay-1.feeder-1.month.") + name;
      const double more = name[7] == 'e' ? 1000 : 0;
      kept_.Add(month, "2026-09-30T21:00:00.000Z", 1500.25 + more);
      kept_.Add(month, "2026-10-31T21:00:00.000Z", 1750.5 + more);
    }
    kept_.Add("bay-1.feeder-1.month.active_import_t2", "2026-10-31T21:00:00.000Z", 250.0);
    kept_.Add("bay-1.feeder-1.day.active_import", "2026-11-01T21:00:00.000Z", {},
              Quality::bad_configuration);
    GatewayInfo info{"1.2.3", kStarted};
    info.events = &kept_;
    StartServerWith(std::move(info));
  }
  ~BillingTest() override { StopServer(); }

  int Run(HistoryOptions options) {
    out_.str({});
    err_.str({});
    options.socket = path();
    if (options.points.empty()) options.points = {"bay-1.feeder-1"};
    return RunBilling(options, out_, err_);
  }

  KeptReadings kept_;
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(BillingTest, ATableOfReadingsAndTariffsByTheDateOfTheMeter) {
  ASSERT_EQ(Run({}), 0) << err_.str();
  EXPECT_EQ(
      out_.str(),
      "meter           reading  date        tariff  import kWh  export kWh  quality\n"
      "bay-1.feeder-1  month    2026-10-01  all     1500.25     2500.25\n"
      "bay-1.feeder-1  month    2026-11-01  all     1750.5      2750.5\n"
      "bay-1.feeder-1  month    2026-11-01  2       250.0\n"
      "bay-1.feeder-1  day      2026-11-02  all                             bad: configuration\n");
  EXPECT_THAT(err_.str(), IsEmpty());
}

TEST_F(BillingTest, CsvHasPlainNumbersAndEmptyCells) {
  HistoryOptions options;
  options.csv = true;
  options.since = ParseWallTime("2026-11-01").value();
  options.until = ParseWallTime("2026-11-02").value();
  ASSERT_EQ(Run(options), 0) << err_.str();
  EXPECT_EQ(out_.str(),
            "meter,reading,date,tariff,active_import_kwh,active_export_kwh,reactive_import_kvarh,"
            "reactive_export_kvarh,quality_text\r\n"
            "bay-1.feeder-1,month,2026-11-01,all,1750.5,2750.5,,,good\r\n"
            "bay-1.feeder-1,month,2026-11-01,2,250.0,,,,good\r\n");
}

TEST_F(BillingTest, JsonIsOneObjectALine) {
  HistoryOptions options;
  options.json = true;
  options.since = ParseWallTime("2026-11-02").value();
  ASSERT_EQ(Run(options), 0) << err_.str();
  const auto row = Json::parse(out_.str());
  EXPECT_EQ(row["date"], "2026-11-02");
  EXPECT_EQ(row["time"], "2026-11-01T21:00:00.000Z");
  EXPECT_EQ(row["tariff"], 0);
  EXPECT_TRUE(row["active_import"].is_null());
}

TEST_F(BillingTest, WhereNoneAreKeptItSaysWhatToDo) {
  EXPECT_EQ(Run({.points = {"bay-1.feeder-2"}}), 2);
  EXPECT_THAT(out_.str(), IsEmpty());
  EXPECT_EQ(Run({.points = {"bay-1.nobody"}}), 2);
  EXPECT_THAT(err_.str(), HasSubstr("nobody"));
  HistoryOptions options;
  options.until = ParseWallTime("2020-01-01").value();
  EXPECT_EQ(Run(options), 0);
  EXPECT_EQ(out_.str(), "no billing readings are kept of that time\n");
}

}  // namespace
}  // namespace baudgate::control
