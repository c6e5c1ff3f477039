// What is said of exchanges that failed, and of requests that a device refuses. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/status/evidence.h"

namespace baudgate::control {

/// A single failure of a device that answers is not worth a sentence.
inline constexpr std::size_t kNotableFailures = 2;

/// "cause: remedy" behind `before`, and in sentences of their own what goes with it.
std::vector<std::string> Said(const std::string& before, const Evidence& evidence);
/// Requests come back, and what fails looks like that. The line's sentence says it.
bool FailsByEchoes(const Evidence& evidence);
/// What fails, and what it refuses: what there is more of comes first.
std::vector<std::string> Failures(const DeviceRecord& record, const Evidence& evidence);

}  // namespace baudgate::control
