// What a running gateway knows of itself, its lines and its devices, as one JSON object: the answer
// to `baudgate status`. docs/status.md has it field by field; fields are only ever added.
// ReloadState tells which configuration runs, FilesJson tells of files without a part of their own,
// and SettingsJson gives the settings of a device.
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

// Which configuration the gateway runs with, as `baudgate status` says it. Written by
// gateway/daemon/reloader.h.
struct ReloadState {
  std::string file;    ///< of the configuration
  std::string folder;  ///< of the confirmed copy; empty: none is kept
  WallTime applied{};  ///< what runs now
  /// Until then somebody has to confirm it, or the one before is taken again.
  std::optional<WallTime> confirm_until{};
  /// Why `file` is not what runs: a sentence; empty: it is, for all that is known.
  std::string not_the_file;
  /// What was found when the file was looked at last: it differs from what runs, or cannot be read.
  /// A sentence; empty: neither.
  std::string file_changed;
  /// Why the confirmed copy cannot be written; empty: it is written.
  std::string not_kept;
};

// Files that have no part of the status of their own: how many are open, and which small ones
// cannot be written.
struct FilesState {
  std::size_t open = 0;   ///< of this process
  std::size_t limit = 0;  ///< 0: there is none
  std::vector<std::string> troubles{};
};

nlohmann::ordered_json FilesJson(const FilesState& state);

/// What to do with damaged databases, by name, in this folder; empty: there are none.
std::string PutAsideAdvice(const std::filesystem::path& folder,
                           const std::vector<std::string>& files);

using Json = nlohmann::ordered_json;

struct GatewayInfo {
  std::string version;
  Instant started{};                                        ///< when the lines began to poll
  const outputs::OutputList* outputs = nullptr;             ///< null: there are none
  const audit::AuditSource* audit = nullptr;                ///< null: nothing can be written
  events::EventSource* events = nullptr;                    ///< null: none are kept
  std::shared_ptr<const history::HistorySource> history{};  ///< null: nothing is kept
  /// Since when the thread of a line hangs; empty: nobody watches them.
  std::function<std::optional<WallTime>(std::uint32_t line)> stuck_since{};
  std::function<ReloadState()> reload{};  ///< empty: nothing is reloaded
  std::function<FilesState()> files{};    ///< empty: nobody knows
};

/// {"point":"current_l1","value":0.52,"unit":"xIn","quality":192,"quality_text":"good","age_ms":120}
Json PointJson(const bus::DeviceRecord& record, std::size_t index, Instant now);

/// Everything; or one line; or one device, and then with its values.
Json StatusJson(const config::Config& config, const bus::PointStore& store, const GatewayInfo& info,
                const std::optional<Target>& target, Now now);

// The settings of a device as the gateway knows them at present: the answer to the control socket's
// request "settings". docs/settings.md has it field by field.

/// Every setting with its value, quality and age, as the store has them; nothing is asked. An error
/// where the device has none.
Result<Json> SettingsJson(const config::Config& config, const bus::PointStore& store, Target target,
                          Now now);

}  // namespace baudgate::status
