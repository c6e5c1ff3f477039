// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/write_path.h"

#include "gateway/base/log.h"

namespace baudgate {
namespace {

audit::AuditLog::Options OptionsOf(const config::Config& config, const EventsPlace& place) {
  audit::AuditLog::Options options;
  options.file = place.file;
  options.why_no_file = place.why_no_file;
  options.turn = place.turn;
  options.require = config.audit == config::Audit::require;
  options.clocks = ReadClocks;
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  return options;
}

}  // namespace

WritePath::WritePath(const config::Config& config, const PointStore& store, CommandSink& lines,
                     const EventsPlace& place)
    : log_(OptionsOf(config, place)), audited_(store, lines, log_, config.audit, ReadClocks) {}

}  // namespace baudgate
