// What a running gateway knows of itself, its lines and its devices, as one JSON object: the answer
// to `baudgate status`. docs/status.md has it field by field; fields are only ever added.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/link/link_state.h"
#include "gateway/outputs/modbus/service/traffic.h"
#include "gateway/outputs/status/files_json.h"
#include "gateway/outputs/status/reload_state.h"
#include "gateway/outputs/status/target.h"
#include "gateway/records/audit/audit_source.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/history/history_source.h"

namespace baudgate::control {

using Json = nlohmann::ordered_json;

struct GatewayInfo {
  std::string version;
  Instant started{};                                        ///< when the lines began to poll
  const modbus::TrafficSource* traffic = nullptr;           ///< null: no Modbus server
  std::function<dds::LinkState()> dds{};                    ///< empty: DDS is off
  const audit::AuditSource* audit = nullptr;                ///< null: nothing can be written
  events::EventSource* events = nullptr;                    ///< null: none are kept
  std::shared_ptr<const history::HistorySource> history{};  ///< null: nothing is kept
  /// Since when the thread of a line hangs; empty: nobody watches them.
  std::function<std::optional<WallTime>(std::uint32_t line)> stuck_since{};
  std::function<ReloadState()> reload{};  ///< empty: nothing is reloaded
  std::function<FilesState()> files{};    ///< empty: nobody knows
};

/// {"point":"current_l1","value":0.52,"unit":"xIn","quality":192,"quality_text":"good","age_ms":120}
Json PointJson(const DeviceRecord& record, std::size_t index, Instant now);

/// Everything; or one line; or one device, and then with its values.
Json StatusJson(const config::Config& config, const PointStore& store, const GatewayInfo& info,
                const std::optional<Target>& target, Now now);

}  // namespace baudgate::control
