// The audit in the answers of the control socket: how it is, and its records.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "gateway/records/audit/audit_source.h"

namespace baudgate::control {

/// {"state":"fine","since":…,"mode":"best_effort","trouble":"","waiting":0,"lost":0,"file":…,
///  "advice":[…]}
nlohmann::ordered_json AuditJson(const audit::AuditState& state);

/// One write, as `baudgate writes --json` prints it.
nlohmann::ordered_json WriteJson(const audit::WriteRecord& record);

/// {"records":[…],"next":412,"more":false}
nlohmann::ordered_json PageJson(const audit::Page& page);

}  // namespace baudgate::control
