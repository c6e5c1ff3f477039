// Tables of counters and facts. Beside each status struct stands its visitor, which names each
// member that is shown, once and in the order of the JSON:
//
//     template <typename Visit>
//     void VisitFields(const DeviceStatus*, Visit visit) {
//       visit(Counted<&DeviceStatus::retries>{.label = "retries"});
//       visit(Counted<&DeviceStatus::busy>{.key = "busy_ms"});
//     }
//
// The JSON (gateway/outputs/status/value_json.h) and /metrics (gateway/outputs/series.h) follow
// from the rows. The text of `status` and the page follow from the labels, which stand in the JSON.
//
// A new counter: 1. the member and, beside it, its row: with a label for the text of `status` and
// the page, with metric and help for /metrics; 2. the place that counts it, such as
// gateway/bus/counters/accounts.cpp or gateway/bus/counters/line_account.cpp, and for a new cause
// an On… method in their headers and its call; 3. docs/status-reference.md, with a metric also
// docs/metrics.md. Tests demand both.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/fields.h"

namespace baudgate::bus {

/// One row: a member, or a function without arguments, and where its value is shown. The type says
/// how: a time whose key ends in _ms or _us is shown in that unit, an instant by its age.
template <auto kMember>
struct Counted {
  static constexpr auto member = kMember;
  static constexpr bool in_json = true;
  std::string_view key = config::MemberName<kMember>();
  /// "missed periods": the text of `status` and the page list it; empty: they do not.
  std::string_view label{};
  /// In that list the least stands first, rows of one place in the order of the table.
  int place = 0;
  /// "baudgate_exchanges_total"; empty: /metrics does not have it. Names are a public contract.
  std::string_view metric{};
  /// Explains the metric, in the line `# HELP` of /metrics.
  std::string_view help{};
};

/// The same of a member that the JSON does not have.
template <auto kMember>
struct NotInJson {
  static constexpr auto member = kMember;
  static constexpr bool in_json = false;
  std::string_view metric{};
  std::string_view help{};
};

}  // namespace baudgate::bus
