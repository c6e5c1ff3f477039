// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/write_path.h"

#include "gateway/base/log.h"

namespace baudgate {
namespace {

constexpr const char* kEventsFile = "events.db";

audit::AuditLog::Options OptionsOf(const config::Config& config,
                                   const std::filesystem::path& folder, const std::string& why) {
  audit::AuditLog::Options options;
  if (!folder.empty()) options.file = folder / kEventsFile;
  options.why_no_file = "there is no state folder for it: " + why;
  options.require = config.audit == config::Audit::require;
  options.clocks = ReadClocks;
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  return options;
}

}  // namespace

WritePath::WritePath(const config::Config& config, const PointStore& store, CommandSink& lines,
                     const std::filesystem::path& folder, const std::string& why)
    : log_(OptionsOf(config, folder, why)),
      audited_(store, lines, log_, config.audit, ReadClocks) {}

}  // namespace baudgate
