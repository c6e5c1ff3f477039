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
#include "gateway/records/audit/security_journal.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::status {

// ReloadState describes the running configuration. gateway/daemon/reloader.h fills it.
struct ReloadState {
  std::string file;
  std::string folder;  ///< folder of the copy of the confirmed configuration; empty: no copy
  WallTime applied{};  ///< time when the running configuration was applied
  /// The time until which somebody must confirm the configuration. Without a confirmation, the
  /// previous configuration is applied again. Nothing: no confirmation is needed.
  std::optional<WallTime> confirm_until{};
  /// A sentence: why the running configuration is not that of `file`; empty: no difference is
  /// known.
  std::string not_the_file;
  /// A sentence about the last check of `file`: the file differs from the running configuration, or
  /// cannot be read. Empty: the file can be read and does not differ.
  std::string file_changed;
  /// Why the copy of the confirmed configuration cannot be written; empty: it can be written.
  std::string not_kept;
};

struct FilesState {
  std::size_t open = 0;
  std::size_t limit = 0;  ///< the most files that the process can have open; 0: no limit
  /// Sentences about files that cannot be used or written, and about certificates that end soon.
  std::vector<std::string> troubles{};
};

/// The certificate of one use that ends first.
struct CertificateEnd {
  std::string use;  ///< "web", "listener 0.0.0.0:802", "line bay-1", "dds"
  WallTime until{};
};

nlohmann::ordered_json FilesJson(const FilesState& state);

std::string PutAsideAdvice(const std::filesystem::path& folder,
                           const std::vector<std::string>& files);

using Json = nlohmann::ordered_json;

struct GatewayInfo {
  std::string version;
  Instant started{};
  const outputs::OutputList* outputs = nullptr;             ///< null: there are no outputs
  const audit::AuditSource* audit = nullptr;                ///< null: nothing can be written
  events::EventSource* events = nullptr;                    ///< null: no events are stored
  std::shared_ptr<const history::HistorySource> history{};  ///< null: no values are stored
  /// Returns since when the thread of a line hangs; nothing: it does not hang. If this function is
  /// empty, the threads are not monitored.
  std::function<std::optional<WallTime>(std::uint32_t line)> stuck_since{};
  std::function<ReloadState()> reload{};  ///< empty: the gateway does not support reloads
  std::function<FilesState()> files{};    ///< empty: the files are not known
  /// Returns the ends of the certificates; empty: they are not known.
  std::function<std::vector<CertificateEnd>()> certificates{};
  audit::SecurityJournal* journal = nullptr;  ///< null: the acts of users are not recorded
};

/// Returns {"point":"current_l1","value":0.52,"shown":"0.5200","unit":"xIn","quality":192,
/// "quality_text":"good","age_ms":120}
Json PointJson(const bus::DeviceRecord& record, std::size_t index, Instant now);

/// Returns the status of everything; if `target` is given, only that of one line, or of one device
/// with its values.
Json StatusJson(const config::Config& config, const bus::PointStore& store, const GatewayInfo& info,
                const std::optional<Target>& target, Now now);

/// Returns the answer to the request "settings" (docs/settings.md): every setting of a device with
/// its value, quality and age, as the store contains them; no request is sent to the device.
/// Returns an error if the device has no settings.
Result<Json> SettingsJson(const config::Config& config, const bus::PointStore& store, Target target,
                          Now now);

}  // namespace baudgate::status
