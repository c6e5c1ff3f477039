// `Series` and `Families` write the text that Prometheus reads at /metrics (text format 0.0.4): a
// Series contains the values of one metric, Families contains all metrics of a table of counters
// (gateway/bus/points/counted.h).
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

struct Metric {
  std::string_view name;  ///< e.g. "baudgate_modbus_clients"
  std::string_view type;  ///< type of the metric: "counter", "gauge" or "histogram"
  std::string_view help;
};

/// Returns `text` as the value of a label: `"`, `\\` and line ends are escaped.
std::string EscapedLabel(std::string_view text);

class Series {
 public:
  explicit Series(const Metric& metric) : metric_(metric) {}
  Series(const Metric& metric, double value) : metric_(metric) { Add("", value); }

  /// Adds a value. `labels`: e.g. `line="bay-1"`, without braces; empty: no labels. `suffix`
  /// follows the metric's name, e.g. "_bucket".
  void Add(std::string_view labels, double value, std::string_view suffix = "");
  /// Appends the metric's HELP, TYPE and values to `out`. Appends nothing if there are no values.
  void AppendTo(std::string& out) const;

 private:
  Metric metric_;
  std::string text_;
};

// `EachValue` calls `add` for each Prometheus value of one counter in a table
// (gateway/bus/points/counted.h): once for a number, several times for an array or a histogram.
// `label` is a further label, e.g. `outcome="ok"` (empty: no label). `suffix` follows the metric's
// name. An empty `value`: there is no value now.

using AddValue = std::function<void(std::string_view label, std::optional<double> value,
                                    std::string_view suffix)>;
/// Adds 1 for the present state, and 0 for every other state.
void EachValue(bus::DeviceState state, const AddValue& add);
void EachValue(const bus::TimeByUse& times, const AddValue& add);
/// Adds a histogram in seconds. Each bucket ends at twice the time of the bucket before; the last
/// bucket has no upper bound.
void EachValue(const bus::RoundTrips& trips, const AddValue& add);
inline void EachValue(bus::LineStatus::Port port, const AddValue& add) {
  add("", port == bus::LineStatus::Port::open ? 1 : 0, "");
}
inline void EachValue(Duration duration, const AddValue& add) {
  add("", std::chrono::duration<double>(duration).count(), "");
}
/// Adds the time in seconds since 1970. For the epoch, which means "not yet", adds no value.
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

/// Calls use(row, value) for each row of the table that has a metric. Rows whose type has no
/// EachValue are skipped.
template <config::HasFields T, typename Use>
void EachMetric(const T& its, Use use) {
  VisitFields(&its, [&](auto row) {
    const auto& value = std::invoke(row.member, its);
    if constexpr (requires { EachValue(value, AddValue()); }) {
      if (!row.metric.empty()) use(row, value);
    }
  });
}

template <config::HasFields T>
std::size_t SeriesIn() {
  std::size_t count = 0;
  EachMetric(T(), [&count](auto /*row*/, const auto& value) {
    EachValue(value, [&count](auto...) { ++count; });
  });
  return count;
}

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
  /// Adds the values of `its` to the metrics. `labels`: e.g. `line="bay-1"`.
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
