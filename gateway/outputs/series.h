// What Prometheus reads at /metrics, in its text format 0.0.4: Series has the lines of one metric,
// Families those of a table (gateway/bus/points/counted.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/counted.h"
#include "gateway/bus/points/device_status.h"
#include "gateway/bus/points/line_status.h"

namespace baudgate::outputs {

/// A metric of Prometheus; docs/metrics.md has all of them.
struct Metric {
  std::string_view name;  ///< "baudgate_modbus_clients"
  std::string_view type;  ///< "counter", "gauge" or "histogram"
  std::string_view help;
};

/// A text as the value of a label: `"`, `\\` and line ends are escaped.
std::string EscapedLabel(std::string_view text);

/// A metric and its present values.
class Series {
 public:
  explicit Series(const Metric& metric) : metric_(metric) {}
  /// One value without labels.
  Series(const Metric& metric, double value) : metric_(metric) { Add("", value); }

  /// `labels`: `line="bay-1"`, without braces; empty: none.
  void Add(std::string_view labels, double value, std::string_view suffix = "");
  /// Nothing if it has no value.
  void AppendTo(std::string& out) const;

 private:
  Metric metric_;
  std::string text_;
};

// The values of a member of a table by its type: one call for each, with a further label
// (`outcome="ok"`; empty: none) and the suffix of the name. No value: it is absent now.

using AddValue = std::function<void(std::string_view label, std::optional<double> value,
                                    std::string_view suffix)>;
/// 1 for the state, 0 for the others.
void EachValue(bus::DeviceState state, const AddValue& add);
/// Seconds, by LineUse.
void EachValue(const bus::TimeByUse& times, const AddValue& add);
/// Seconds, in buckets of an octave each, the last without a bound.
void EachValue(const bus::RoundTrips& trips, const AddValue& add);
inline void EachValue(bus::LineStatus::Port port, const AddValue& add) {
  add("", port == bus::LineStatus::Port::open ? 1 : 0, "");
}
/// Seconds.
inline void EachValue(Duration duration, const AddValue& add) {
  add("", std::chrono::duration<double>(duration).count(), "");
}
/// Seconds since the epoch, which itself stands for "not yet".
inline void EachValue(WallTime time, const AddValue& add) {
  if (time != WallTime{}) return EachValue(time.time_since_epoch(), add);
  add("", std::nullopt, "");
}
template <std::integral Count>
void EachValue(const std::array<Count, kOutcomeCount>& counts, const AddValue& add) {
  for (std::size_t i = 1; i < kOutcomeCount; ++i) {
    const std::string outcome(Name(static_cast<Outcome>(i)));
    add("outcome=\"" + outcome + "\"", static_cast<double>(counts[i]), "");
  }
}
template <typename Number>
requires std::is_arithmetic_v<Number>
void EachValue(Number number, const AddValue& add) { add("", static_cast<double>(number), ""); }

/// Calls use(row, value) for each row of a table that has a metric. Rows of a type without
/// EachValue have none.
template <config::HasFields T, typename Use>
void EachMetric(const T& its, Use use) {
  VisitFields(&its, [&](auto row) {
    const auto& value = std::invoke(row.member, its);
    if constexpr (requires { EachValue(value, AddValue()); }) {
      if (!row.metric.empty()) use(row, value);
    }
  });
}

/// How many series a table gives at most.
template <config::HasFields T>
std::size_t SeriesIn() {
  std::size_t count = 0;
  EachMetric(T(), [&count](auto /*row*/, const auto& value) {
    EachValue(value, [&count](auto...) { ++count; });
  });
  return count;
}

/// The metrics of a table, in the order of its rows.
template <config::HasFields T>
class Families {
 public:
  Families() {
    EachMetric(T(), [this]<typename Value>(auto row, const Value&) {
      std::string_view type = row.metric.ends_with("_total") ? "counter" : "gauge";
      if (std::is_same_v<Value, bus::RoundTrips>) type = "histogram";
      all_.emplace_back(Metric{row.metric, type, row.help});
    });
  }
  /// `labels`: `line="bay-1"`.
  void Add(const T& its, const std::string& labels) {
    auto series = all_.begin();
    EachMetric(its, [&](auto /*row*/, const auto& of) {
      EachValue(of, [&](std::string_view label, std::optional<double> value, auto suffix) {
        const std::string more = label.empty() ? "" : "," + std::string(label);
        if (value) series->Add(labels + more, *value, suffix);
      });
      ++series;
    });
  }
  const std::vector<Series>& all() const { return all_; }

 private:
  std::vector<Series> all_;
};

}  // namespace baudgate::outputs
