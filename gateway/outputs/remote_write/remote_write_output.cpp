// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/remote_write/remote_write_output.h"

#include "gateway/base/log.h"
#include "gateway/outputs/outlet/report.h"

namespace baudgate::remote_write {
namespace {

constexpr outlet::MetricNames kNames = {
    "baudgate_remote_write_behind_seconds", "baudgate_remote_write_confirmed_total",
    "baudgate_remote_write_refused_total", "baudgate_remote_write_gaps_total"};

}  // namespace

RemoteWriteOutput::Running::Running(const config::Config& config, const Links& links)
    : settings(config.remote_write),
      writer(config.remote_write),
      forwarder({.name = "remote_write",
                 .receiver = &writer,
                 .folder = links.folder,
                 .why_no_folder = links.why_no_folder,
                 .watch =
                     [alarms = links.alarms](const outlet::ForwarderState& state, Now now) {
                       if (alarms) alarms(outlet::AlarmsOf(state, now.wall), now);
                     },
                 .warn = [](const std::string& line) { log::Warn("{}", line); },
                 .inform = [](const std::string& line) { log::Info("{}", line); }}) {}

Status RemoteWriteOutput::Begin(const Configuration& config) {
  Apply(config, nullptr);
  return {};
}

std::vector<std::string> RemoteWriteOutput::Apply(const Configuration& config,
                                                  std::unique_ptr<Prepared> /*prepared*/) {
  const config::RemoteWrite& next = config->remote_write;
  std::shared_ptr<Running> running;
  {
    const MutexLock lock(mutex_);
    running = running_;
  }
  if (running && (!next.on || !config::Same(running->settings, next))) {
    {
      const MutexLock lock(mutex_);
      running_.reset();
    }
    running.reset();  // waits for the thread
    if (!next.on) {
      log::Info("remote_write: ended");
      if (links_.alarms) links_.alarms({}, ReadClocks());
    }
  }
  if (!next.on) return {};
  if (!running) running = std::make_shared<Running>(*config, links_);
  running->writer.SetNames(std::make_shared<SeriesNames>(*config));
  running->forwarder.SetHistory(history_);
  const MutexLock lock(mutex_);
  running_ = std::move(running);
  return {};
}

void RemoteWriteOutput::SetHistory(const Configuration& /*config*/,
                                   const std::shared_ptr<const history::HistorySource>& history) {
  history_ = history;
  const MutexLock lock(mutex_);
  if (running_) running_->forwarder.SetHistory(history);
}

void RemoteWriteOutput::Stop() {
  std::shared_ptr<Running> running;
  {
    const MutexLock lock(mutex_);
    running = std::exchange(running_, nullptr);
  }
}

std::string RemoteWriteOutput::Summary() {
  const MutexLock lock(mutex_);
  return running_ ? "remote write to " + running_->settings.url : std::string();
}

std::optional<outputs::Output::Json> RemoteWriteOutput::Section(const Wish& /*wish*/) const {
  const MutexLock lock(mutex_);
  if (!running_) return Json(nullptr);
  Json json = {{"url", running_->settings.url}};
  json.update(outlet::SectionOf(running_->forwarder.state()));
  return json;
}

std::vector<outputs::Series> RemoteWriteOutput::Metrics() const {
  const MutexLock lock(mutex_);
  if (!running_) return {};
  return outlet::SeriesOf(kNames, running_->forwarder.state());
}

}  // namespace baudgate::remote_write
