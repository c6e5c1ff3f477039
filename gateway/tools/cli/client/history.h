// `baudgate history`: prints recorded values, or their means, minima and maxima, oldest first. With
// --billing, prints billing readings of meters.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/tools/cli/client/control_client.h"

namespace baudgate::tools {

struct HistoryOptions {
  std::vector<std::string> points{};  ///< LINE.DEVICE.POINT, or patterns with * and ?
  std::optional<WallTime> since{};
  std::optional<WallTime> until{};
  /// Length of the intervals whose mean, minimum and maximum are printed; empty: prints each value.
  std::optional<Duration> every{};
  bool json = false;
  bool csv = false;
  bool billing = false;
  std::string socket{};   ///< path of the control socket; empty: the only running gateway is used
  std::size_t width = 0;  ///< width of tables, in characters per line; 0: no limit
};

/// Exit codes: 0 done, even if there are no records for that time; 2 unknown point, or its values
/// are not recorded; 4 no gateway answers, or the gateway records no values or cannot read one of
/// its files.
int RunHistory(const HistoryOptions& options, std::ostream& out, std::ostream& err);

// `HistoryStream` reads the records of one point from the gateway, page by page.
class HistoryStream {
 public:
  using Json = ControlClient::Json;

  /// `client` and `err` must outlive this object. `point`: LINE.DEVICE.POINT, or
  /// LINE.DEVICE.load_1.active_import for a load profile of a meter.
  HistoryStream(ControlClient& client, const HistoryOptions& options, const std::string& point,
                std::ostream& err);

  /// Sets `record` to the next record; null: there are no more records. Returns the exit code. A
  /// failure is printed on `err`.
  int Next(const Json*& record);
  void Pop() { ++at_; }
  /// Returns the history files that the gateway could not read so far, each with the reason.
  const std::vector<std::string>& unread() const { return unread_; }

 private:
  int Fetch();

  ControlClient& client_;
  Json request_;
  std::ostream& err_;
  Json page_ = Json::array();
  std::vector<std::string> unread_;
  std::size_t at_ = 0;
  bool done_ = false;
};

// `baudgate history --billing`: prints billing readings of meters as a table with one row for each
// reading and tariff.
//
//   meter      reading  date        tariff  import kWh  export kWh  …  quality
//   meters.m1  month    2026-11-01  all     1500.25     0
//   meters.m1  month    2026-11-01  1       1000.25     0

/// Each of `options.points` is a LINE.DEVICE. Days are the meter's local dates; `until` is the
/// first date that is not printed. The exit codes are those of RunHistory.
int RunBilling(const HistoryOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
