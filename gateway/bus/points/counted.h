// `Counted` is one row of a table of counters. Beside each struct of the status (DeviceStatus,
// LineStatus) is a function VisitFields that has a row for each shown member, in the order of the
// JSON:
//
//     template <typename Visit>
//     void VisitFields(const DeviceStatus*, Visit visit) {
//       visit(Counted<&DeviceStatus::retries>{.label = "retries"});
//       visit(Counted<&DeviceStatus::busy>{.key = "busy_ms"});
//     }
//
// The JSON (gateway/outputs/status/value_json.h) and /metrics (gateway/outputs/series.h) are made
// from these rows. The JSON contains the labels; the text of `baudgate status` and the web page are
// made from the JSON.
//
// To add a counter:
// 1. Add the member and, beside it, its row. `label` is for the text of `status` and the web page,
//    `metric` and `help` are for /metrics.
// 2. Count it, for example in gateway/bus/counters/accounts.cpp or
//    gateway/bus/counters/line_account.cpp. For a new cause add an On… method to the class there.
// 3. Describe it in docs/status-reference.md, with a metric also in docs/metrics.md. Tests require
// both.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/fields.h"

namespace baudgate::bus {

/// A row of the table: a member of a status struct, or a member function without parameters, and
/// where its value is shown. The type of the member decides the form: a duration whose key ends in
/// _ms or _us is shown in that unit, an instant as its age.
template <auto kMember>
struct Counted {
  static constexpr auto member = kMember;
  static constexpr bool in_json = true;
  std::string_view key = config::MemberName<kMember>();
  /// Name in the text of `status` and on the web page, such as "missed periods". Empty: the member
  /// is not shown there.
  std::string_view label{};
  /// Order of the labels in the text of `status` and on the web page: the smallest `place` comes
  /// first. Rows with equal `place` keep the order of the table.
  int place = 0;
  /// Name in /metrics, such as "baudgate_exchanges_total". Empty: the member is not in /metrics.
  /// Names are a public contract.
  std::string_view metric{};
  /// Explains the metric, in the line `# HELP` of /metrics.
  std::string_view help{};
};

/// A row for a member that is not in the JSON.
template <auto kMember>
struct NotInJson {
  static constexpr auto member = kMember;
  static constexpr bool in_json = false;
  std::string_view metric{};
  std::string_view help{};
};

}  // namespace baudgate::bus
