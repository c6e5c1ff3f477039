// What is said of a device that speaks when it likes. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gateway/status/evidence.h"

namespace baudgate::control {

/// Nothing that it says can be read, or much cannot.
std::vector<std::string> Unreadable(const DeviceRecord& record, const Evidence& evidence);
std::vector<std::string> Silence(const DeviceRecord& record, Now now);
/// Values that have to come again and again; nothing: it may be silent for ever, as a reader at
/// which nobody reads.
std::optional<Duration> MustSpeakWithin(const DeviceRecord& record);

/// The period at which it sends, where its values are too old before the next ones come. Empty:
/// they are not, or it has stopped.
std::optional<Duration> ComesEvery(const DeviceRecord& record, Instant now);
/// It speaks by itself, and answers nothing that it is asked.
std::vector<std::string> AnswersNothing(const DeviceRecord& record, const Evidence& evidence);

}  // namespace baudgate::control
