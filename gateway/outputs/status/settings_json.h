// The settings of a device as the gateway knows them at present: the answer to the control socket's
// request "settings". docs/settings.md has it field by field.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/result.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::control {

/// Every setting with its value, quality and age, as the store has them; nothing is asked. An error
/// where the device has none.
Result<Json> SettingsJson(const config::Config& config, const PointStore& store, Target target,
                          Now now);

}  // namespace baudgate::control
