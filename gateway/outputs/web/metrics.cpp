// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/metrics.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

#include "gateway/base/log.h"
#include "gateway/outputs/outlet/report.h"
#include "gateway/outputs/series.h"

namespace baudgate::web {

namespace {

// The names of metrics are a public contract (docs/metrics.md). The names for lines and devices are
// in VisitFields of bus::LineStatus and bus::DeviceStatus.

double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

class Store {
 public:
  Store(const config::Config& config, const bus::PointStore& store, Now now) : now_(now) {
    for (std::uint32_t line = 0; line < config.lines.size(); ++line) {
      const std::string& name = config.lines[line].name;
      if (name.empty()) continue;
      lines_.Add(store.ReadLine(line), fmt::format("line=\"{}\"", outputs::EscapedLabel(name)));
    }
    for (std::uint32_t device = 0; device < store.device_count(); ++device) {
      if (store.gone(device)) continue;
      bus::DeviceRecord record;
      if (!store.Read(device, [&](const bus::DeviceRecord& held) { record = held; })) continue;
      const std::string labels =
          fmt::format("line=\"{}\",device=\"{}\"", outputs::EscapedLabel(record.line->name),
                      outputs::EscapedLabel(record.device->name));
      devices_.Add(record.status, labels);
      for (std::size_t i = 0; i < record.points.size(); ++i) AddPoint(record, i, labels);
    }
  }

  void AppendTo(std::string& out) const {
    for (const outputs::Series& series : lines_.all()) series.AppendTo(out);
    for (const outputs::Series& series : devices_.all()) series.AppendTo(out);
    for (const outputs::Series* series : {&values_, &qualities_, &ages_}) series->AppendTo(out);
  }

 private:
  void AddPoint(const bus::DeviceRecord& record, std::size_t index, const std::string& device) {
    const config::Point& point = record.device->points[index];
    if (point.access == config::Access::write) return;
    const std::string labels =
        fmt::format("{},point=\"{}\"", device, outputs::EscapedLabel(point.name));
    const Quality quality = QualityAt(record, index, now_.instant);
    const Value& value = record.points[index].value;
    if (IsGood(quality) && HasValue(value) && !std::holds_alternative<std::string>(value)) {
      values_.Add(fmt::format("{},unit=\"{}\"", labels, outputs::EscapedLabel(point.unit)),
                  ToDouble(value));
    }
    qualities_.Add(labels, quality.word());
    if (const auto age = AgeAt(record, index, now_.instant)) ages_.Add(labels, Seconds(*age));
  }

  const Now now_;
  outputs::Families<bus::LineStatus> lines_;
  outputs::Families<bus::DeviceStatus> devices_;
  outputs::Series values_{{"baudgate_point_value", "gauge",
                           "The value; absent while the value is not good, and for texts."}};
  outputs::Series qualities_{
      {"baudgate_point_quality", "gauge", "Quality and reason as one number, 192 is good."}};
  outputs::Series ages_{{"baudgate_point_age_seconds", "gauge",
                         "Time since the last reading; absent before the first."}};
};

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
  // 8 metrics of the gateway: version, clients, log, two for alarms, three for the process.
  std::size_t series = 8;
  if (config.dds.enabled) ++series;
  if (config.dds.enabled && config.dds.security.on()) ++series;
  if (config.remote_write.on) series += outlet::kMetrics;
  series += config::TlsUses(config).size();
  for (const config::Line& line : config.lines) {
    if (line.name.empty()) continue;
    series += outputs::SeriesIn<bus::LineStatus>();
    for (const config::Device& device : line.devices) {
      series += outputs::SeriesIn<bus::DeviceStatus>();
      for (const config::Point& point : device.points) {
        if (point.access == config::Access::write) continue;
        series += point.type == config::Type::string ? 2 : 3;
      }
    }
  }
  return series;
}

std::string MetricsText(const config::Config& config, const bus::PointStore& store,
                        const status::GatewayInfo& info, Now now) {
  std::string text;
  const auto append = [&text](const outputs::Metric& metric, double value) {
    outputs::Series(metric, value).AppendTo(text);
  };
  outputs::Series version(
      {"baudgate_build_info", "gauge", "The version of the gateway; always 1."});
  version.Add(fmt::format("version=\"{}\"", outputs::EscapedLabel(info.version)), 1);
  version.AppendTo(text);
  Store(config, store, now).AppendTo(text);
  if (info.outputs != nullptr) {
    for (const auto& output : *info.outputs) {
      for (const outputs::Series& series : output->Metrics()) series.AppendTo(text);
    }
  }
  if (info.certificates) {
    outputs::Series ends({"baudgate_certificate_end_timestamp_seconds", "gauge",
                          "When the certificate ends, in seconds since 1970."});
    for (const status::CertificateEnd& one : info.certificates()) {
      ends.Add(fmt::format("use=\"{}\"", outputs::EscapedLabel(one.use)),
               Seconds(one.until.time_since_epoch()));
    }
    ends.AppendTo(text);
  }
  append({"baudgate_log_dropped_total", "counter",
          "Log lines that neither the journal nor standard error accepted."},
         static_cast<double>(log::Dropped()));
  if (info.events != nullptr) {
    const events::EventsState state = info.events->state();
    outputs::Series alarms({"baudgate_alarms", "gauge",
                            "Alarms that are active, and alarms that are not acknowledged."});
    alarms.Add("state=\"active\"", static_cast<double>(state.alarms_active));
    alarms.Add("state=\"unacknowledged\"", static_cast<double>(state.alarms_unacknowledged));
    alarms.AppendTo(text);
  }
  append({"process_cpu_seconds_total", "counter", "Processor time of the gateway."},
         ProcessorSeconds());
  append({"process_resident_memory_bytes", "gauge", "Memory of the gateway."}, ResidentBytes());
  append({"process_start_time_seconds", "gauge", "When the gateway began to poll."},
         Seconds(now.wall.time_since_epoch()) - Seconds(now.instant - info.started));
  return text;
}

}  // namespace baudgate::web
