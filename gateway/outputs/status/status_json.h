// `StatusJson` returns the state of a running gateway, its lines and its devices as one JSON
// object, the answer to `baudgate status`. docs/status-reference.md describes the fields; fields
// are only ever added. SettingsJson returns the settings of a device.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/output.h"
#include "gateway/outputs/status/target.h"
#include "gateway/records/audit/audit_source.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::status {

// The running configuration. gateway/daemon/reloader.h fills it.
struct ReloadState {
  std::string file;    ///< of the configuration
  std::string folder;  ///< of the confirmed copy; empty: no copy is stored
  WallTime applied{};  ///< of the running configuration
  /// Until then somebody must confirm the configuration, or the previous one is applied again.
  /// Empty: nothing to confirm.
  std::optional<WallTime> confirm_until{};
  /// Why `file` is not what runs, one sentence; empty: it is, as far as is known.
  std::string not_the_file;
  /// What the last look at the file has found, one sentence: it differs from what runs, or cannot
  /// be read. Empty: neither.
  std::string file_changed;
  /// Why the confirmed copy cannot be written; empty: it can.
  std::string not_kept;
};

// Open files of the process, and small files without a section of their own in the status.
struct FilesState {
  std::size_t open = 0;   ///< files of this process
  std::size_t limit = 0;  ///< 0: no limit
  /// Files that cannot be written, one sentence each.
  std::vector<std::string> troubles{};
};

nlohmann::ordered_json FilesJson(const FilesState& state);

/// What to do with damaged databases `files` in `folder`; empty: there are none.
std::string PutAsideAdvice(const std::filesystem::path& folder,
                           const std::vector<std::string>& files);

using Json = nlohmann::ordered_json;

struct GatewayInfo {
  std::string version;
  Instant started{};                                        ///< when the lines began to poll
  const outputs::OutputList* outputs = nullptr;             ///< null: no outputs
  const audit::AuditSource* audit = nullptr;                ///< null: nothing can be written
  events::EventSource* events = nullptr;                    ///< null: no events are stored
  std::shared_ptr<const history::HistorySource> history{};  ///< null: no values are stored
  /// Returns since when the thread of a line hangs, or nothing if it does not hang. Without this
  /// function the threads are not monitored.
  std::function<std::optional<WallTime>(std::uint32_t line)> stuck_since{};
  std::function<ReloadState()> reload{};  ///< empty: the gateway cannot reload
  std::function<FilesState()> files{};    ///< empty: not known
};

/// Returns
/// {"point":"current_l1","value":0.52,"unit":"xIn","quality":192,"quality_text":"good","age_ms":120}
Json PointJson(const bus::DeviceRecord& record, std::size_t index, Instant now);

/// Everything, or one line, or one device, which then has its values.
Json StatusJson(const config::Config& config, const bus::PointStore& store, const GatewayInfo& info,
                const std::optional<Target>& target, Now now);

/// Every setting of a device with its value, quality and age, as the store has them; the device is
/// not asked. The answer to the request "settings" (docs/settings.md). An error if the device has
/// no settings.
Result<Json> SettingsJson(const config::Config& config, const bus::PointStore& store, Target target,
                          Now now);

}  // namespace baudgate::status
