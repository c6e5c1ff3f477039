// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/write_path.h"

#include <utility>

#include "gateway/base/log.h"

namespace baudgate {
namespace {

audit::AuditLog::Options OptionsOf(const config::Config& config, const EventsPlace& place,
                                   WritePath::Unsettled unsettled) {
  audit::AuditLog::Options options;
  options.file = place.file;
  options.why_no_file = place.why_no_file;
  options.writer = place.writer;
  options.require = config.audit == config::Audit::require;
  options.clocks = ReadClocks;
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  options.unsettled = std::move(unsettled);
  return options;
}

}  // namespace

WritePath::WritePath(const config::Config& config, const PointStore& store, CommandSink& lines,
                     const EventsPlace& place, Unsettled unsettled)
    : unsettled_(std::move(unsettled)),
      log_(OptionsOf(config, place,
                     [this](const std::set<audit::Target>& devices) { OnUnsettled(devices); })),
      audited_(store, lines, log_, config.audit, ReadClocks) {}

void WritePath::OnUnsettled(const std::set<audit::Target>& devices) {
  {
    const MutexLock lock(mutex_);
    if (!started_) {
      early_ = devices;
      return;
    }
  }
  unsettled_(devices);
}

void WritePath::Start() {
  audited_.Start();
  std::set<audit::Target> early;
  {
    const MutexLock lock(mutex_);
    started_ = true;
    early.swap(early_);
  }
  if (!early.empty()) unsettled_(early);
}

}  // namespace baudgate
