// `Counted` is a row of a table of counters. Beside each status struct is a visitor that names each
// shown member once, in the order of the JSON:
//
//     template <typename Visit>
//     void VisitFields(const DeviceStatus*, Visit visit) {
//       visit(Counted<&DeviceStatus::retries>{.label = "retries"});
//       visit(Counted<&DeviceStatus::busy>{.key = "busy_ms"});
//     }
//
// The JSON (gateway/outputs/status/value_json.h) and /metrics (gateway/outputs/series.h) are made
// from the rows. The text of `status` and the web page are made from the labels, which are part of
// the JSON.
//
// To add a counter:
// 1. Add the member and, beside it, its row: with a label for the text of `status` and the page,
//    with metric and help for /metrics.
// 2. Count it in a place such as gateway/bus/counters/accounts.cpp or
//    gateway/bus/counters/line_account.cpp. For a new cause add an On… method in their headers and
//    call it.
// 3. Describe it in docs/status-reference.md, with a metric also in docs/metrics.md. Tests require
// both.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/fields.h"

namespace baudgate::bus {

/// One row: a member, or a function without arguments, and where its value is shown. The type
/// decides the form: a time whose key ends in _ms or _us is shown in that unit, an instant as its
/// age.
template <auto kMember>
struct Counted {
  static constexpr auto member = kMember;
  static constexpr bool in_json = true;
  std::string_view key = config::MemberName<kMember>();
  /// "missed periods": name in the text of `status` and on the page; empty: not shown there.
  std::string_view label{};
  /// Order in that list: the smallest first, rows with the same place in the order of the table.
  int place = 0;
  /// "baudgate_exchanges_total"; empty: not in /metrics. Names are a public contract.
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
