// The one log: lines on standard error, one per change of state, each naming its line and device.
// Repeats are folded: a text that comes again within a minute is counted, and told when the minute
// is over.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <string>

namespace baudgate::log {

enum class Level { debug, info, warning, error };

/// Once, from the composition root. Under systemd (JOURNAL_STREAM) lines carry the syslog priority
/// in place of the time, which the journal knows better.
void Begin(Level least);

/// Keeps the log from drawing over a live table.
void SetLeast(Level least);

/// Thread-safe.
void Write(Level level, const std::string& text);

template <typename... Args>
void Info(fmt::format_string<Args...> form, Args&&... args) {
  Write(Level::info, fmt::format(form, std::forward<Args>(args)...));
}
template <typename... Args>
void Warn(fmt::format_string<Args...> form, Args&&... args) {
  Write(Level::warning, fmt::format(form, std::forward<Args>(args)...));
}
template <typename... Args>
void Fail(fmt::format_string<Args...> form, Args&&... args) {
  Write(Level::error, fmt::format(form, std::forward<Args>(args)...));
}

}  // namespace baudgate::log
