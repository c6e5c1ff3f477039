// `baudgate history`: values that were kept, or what they come to, oldest first. HistoryStream
// reads the records page by page, and RunBilling prints billing readings.
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
  std::optional<Duration> every{};  ///< means, minima and maxima of so long; empty: the values
  bool json = false;
  bool csv = false;
  bool billing = false;   ///< see RunBilling
  std::string socket{};   ///< empty: the gateway in the default places
  std::size_t width = 0;  ///< of tables, characters a line; 0: no limit
};

/// Exit code 0, also where there is nothing, which is said; 4 when no gateway answers, or it keeps
/// no values; 2 there is no such point, or its values are not kept.
int RunHistory(const HistoryOptions& options, std::ostream& out, std::ostream& err);

// The records of one name that a gateway keeps, page by page over its control socket: for
// `baudgate history`.
class HistoryStream {
 public:
  using Json = ControlClient::Json;

  /// Client and `err` outlive it. `point`: LINE.DEVICE.POINT, or of what a meter has measured
  /// itself LINE.DEVICE.load_1.active_import.
  HistoryStream(ControlClient& client, const HistoryOptions& options, const std::string& point,
                std::ostream& err);

  /// The next record; null: there is none. The exit code when it cannot be read, which is told.
  int Next(const Json*& record);
  void Pop() { ++at_; }
  /// Files that could not be read so far, and why.
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

// `baudgate history --billing`: billing readings of meters as a table, one row a reading and
// tariff.
//
//   meter      reading  date        tariff  import kWh  export kWh  …  quality
//   meters.m1  month    2026-11-01  all     1500.25     0
//   meters.m1  month    2026-11-01  1       1000.25     0

/// `options.points` are LINE.DEVICE. Days count by the meter's date, `until` is the first that is
/// not wanted. Exit codes as of RunHistory.
int RunBilling(const HistoryOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
