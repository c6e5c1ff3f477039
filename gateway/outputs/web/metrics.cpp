// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/metrics.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "gateway/base/log.h"

namespace baudgate::web {
namespace {

constexpr std::size_t kDeviceStates = 5;
/// Buckets of the histogram: an octave of round trips each, the last without a bound.
constexpr std::size_t kDurationBuckets = RoundTrips::kBuckets / 4;

double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }
double Seconds(WallTime time) { return Seconds(time.time_since_epoch()); }

/// By LineUse.
constexpr std::array<std::string_view, kLineUses> kWhy = {"poll",  "probe",   "route",
                                                          "write", "silence", "drain"};

/// The lines of one metric, which stand together.
class Lines {
 public:
  explicit Lines(Family family) : Lines(Of(family)) {}
  explicit Lines(const Metric& metric) : metric_(metric) {}

  /// `labels`: `line="bay-1"`, without braces; empty: none.
  void Add(std::string_view labels, double value, std::string_view suffix = "") {
    auto to = std::back_inserter(text_);
    fmt::format_to(to, "{}{}", metric_.name, suffix);
    if (!labels.empty()) fmt::format_to(to, "{{{}}}", labels);
    if (std::isnan(value)) {
      text_ += " NaN\n";
    } else if (std::isinf(value)) {
      text_ += value > 0 ? " +Inf\n" : " -Inf\n";
    } else {
      fmt::format_to(to, " {}\n", value);
    }
  }
  void AppendTo(std::string& out) const {
    if (text_.empty()) return;
    fmt::format_to(std::back_inserter(out), "# HELP {0} {1}\n# TYPE {0} {2}\n", metric_.name,
                   metric_.help, metric_.type);
    out += text_;
  }

 private:
  const Metric metric_;
  std::string text_;
};

class Store {
 public:
  Store(const config::Config& config, const PointStore& store, Now now) : now_(now) {
    for (std::uint32_t line = 0; line < config.lines.size(); ++line) {
      if (!config.lines[line].name.empty()) AddLine(config.lines[line], store.ReadLine(line));
    }
    for (std::uint32_t device = 0; device < store.device_count(); ++device) {
      if (store.gone(device)) continue;
      DeviceRecord record;
      store.Read(device, [&](const DeviceRecord& held) { record = held; });
      AddDevice(record);
    }
  }

  void AppendTo(std::string& out) const {
    for (const Lines* lines : {&up_, &busy_, &durations_, &states_, &last_ok_, &exchanges_,
                               &values_, &qualities_, &ages_}) {
      lines->AppendTo(out);
    }
  }

 private:
  void AddLine(const config::Line& line, const LineStatus& status) {
    const std::string labels = fmt::format("line=\"{}\"", EscapedLabel(line.name));
    up_.Add(labels, status.port == LineStatus::Port::open ? 1 : 0);
    for (std::size_t i = 0; i < kLineUses; ++i) {
      busy_.Add(fmt::format("{},why=\"{}\"", labels, kWhy[i]), Seconds(status.spent[i]));
    }
    const RoundTrips& trips = status.round_trips;
    std::uint64_t below = 0;
    for (std::size_t octave = 0; octave < kDurationBuckets; ++octave) {
      for (std::size_t i = 0; i < 4; ++i) below += trips.buckets()[octave * 4 + i];
      const bool last = octave + 1 == kDurationBuckets;  // it takes all that took longer, too
      if (last) break;
      durations_.Add(
          fmt::format("{},le=\"{}\"", labels, Seconds(RoundTrips::UpperEdge(octave * 4 + 3))),
          static_cast<double>(below), "_bucket");
    }
    const auto count = static_cast<double>(trips.count());
    durations_.Add(labels + ",le=\"+Inf\"", count, "_bucket");
    durations_.Add(labels, Seconds(trips.mean()) * count, "_sum");
    durations_.Add(labels, count, "_count");
  }

  void AddDevice(const DeviceRecord& record) {
    const DeviceStatus& status = record.status;
    const std::string labels =
        fmt::format("line=\"{}\",device=\"{}\"", EscapedLabel(record.line->name),
                    EscapedLabel(record.device->name));
    for (std::size_t i = 0; i < kDeviceStates; ++i) {
      const auto state = static_cast<DeviceState>(i);
      states_.Add(fmt::format("{},state=\"{}\"", labels, Name(state)),
                  status.state == state ? 1 : 0);
    }
    if (status.last_ok) last_ok_.Add(labels, Seconds(status.last_ok_wall));
    for (std::size_t i = 1; i < kOutcomeCount; ++i) {
      exchanges_.Add(fmt::format("{},outcome=\"{}\"", labels, Name(static_cast<Outcome>(i))),
                     status.outcomes[i]);
    }
    for (std::size_t i = 0; i < record.points.size(); ++i) AddPoint(record, i, labels);
  }

  void AddPoint(const DeviceRecord& record, std::size_t index, const std::string& device) {
    const config::Point& point = record.device->points[index];
    if (point.access == config::Access::write) return;
    const std::string labels = fmt::format("{},point=\"{}\"", device, EscapedLabel(point.name));
    const Quality quality = QualityAt(record, index, now_.instant);
    const Value& value = record.points[index].value;
    if (IsGood(quality) && HasValue(value) && !std::holds_alternative<std::string>(value)) {
      values_.Add(fmt::format("{},unit=\"{}\"", labels, EscapedLabel(point.unit)), ToDouble(value));
    }
    qualities_.Add(labels, quality.word());
    if (const auto age = AgeAt(record, index, now_.instant)) ages_.Add(labels, Seconds(*age));
  }

  const Now now_;
  Lines up_{Family::line_up};
  Lines busy_{Family::line_busy};
  Lines durations_{Family::round_trip};
  Lines states_{Family::device_state};
  Lines last_ok_{Family::device_last_ok};
  Lines exchanges_{Family::exchanges};
  Lines values_{Family::point_value};
  Lines qualities_{Family::point_quality};
  Lines ages_{Family::point_age};
};

void AppendOne(Family family, std::string_view labels, double value, std::string& out) {
  Lines lines(family);
  lines.Add(labels, value);
  lines.AppendTo(out);
}

void AppendOutputs(const OutputList& outputs, std::string& out) {
  for (const auto& output : outputs) {
    for (const Series& series : output->Metrics()) {
      Lines lines(series.metric);
      for (const auto& [labels, value] : series.values) lines.Add(labels, value);
      lines.AppendTo(out);
    }
  }
}

double ProcessorSeconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  double all = 0;
  double resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

std::size_t SeriesOf(const config::Config& config) {
  // version, clients, log, two of alarms, three of the process
  std::size_t series = 8;
  if (config.dds.enabled) ++series;
  for (const config::Line& line : config.lines) {
    if (line.name.empty()) continue;
    series += 1 + kLineUses + kDurationBuckets + 2;  // up, busy; buckets, sum and count
    for (const config::Device& device : line.devices) {
      series += kDeviceStates + kOutcomeCount - 1 + 1;
      for (const config::Point& point : device.points) {
        if (point.access == config::Access::write) continue;
        series += point.type == config::Type::string ? 2 : 3;
      }
    }
  }
  return series;
}

std::string MetricsText(const config::Config& config, const PointStore& store,
                        const control::GatewayInfo& info, Now now) {
  std::string text;
  AppendOne(Family::build_info, fmt::format("version=\"{}\"", EscapedLabel(info.version)), 1, text);
  Store(config, store, now).AppendTo(text);
  if (info.outputs != nullptr) AppendOutputs(*info.outputs, text);
  AppendOne(Family::log_dropped, "", static_cast<double>(log::Dropped()), text);
  if (info.events != nullptr) {
    const events::EventsState state = info.events->state();
    Lines alarms(Family::alarms);
    alarms.Add("state=\"active\"", static_cast<double>(state.alarms_active));
    alarms.Add("state=\"unacknowledged\"", static_cast<double>(state.alarms_unacknowledged));
    alarms.AppendTo(text);
  }
  AppendOne(Family::cpu, "", ProcessorSeconds(), text);
  AppendOne(Family::memory, "", ResidentBytes(), text);
  AppendOne(Family::started, "", Seconds(now.wall) - Seconds(now.instant - info.started), text);
  return text;
}

}  // namespace baudgate::web
