// The one log: lines on standard error, one per change of state, each naming its line and device.
// Logging never waits for the reader: a line that finds no room is dropped and counted.
// Repeats are folded: a text that comes again within a minute is counted, and reported when the
// minute is over.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace baudgate::log {

enum class Level { debug, info, warning, error };

/// What a text is about: said before it ("line bay: device relay: offline"). In the journal they
/// are fields besides (LINE=, DEVICE=, OUTCOME=); the outcome, as of outcome.h, is only there.
struct About {
  std::string line{};
  std::string device{};
  std::string outcome{};
  /// Further fields of the journal, name and value.
  std::vector<std::pair<std::string, std::string>> fields{};
};

/// Once, from the composition root. Where standard error is systemd's journal, lines go to its
/// `socket` with priority and fields; it knows the time better.
void Begin(Level least, const std::string& socket = "/run/systemd/journal/socket");

/// Keeps the log from drawing over a live table.
void SetLeast(Level least);

/// Thread-safe.
void Write(Level level, const std::string& text);
void Write(Level level, const About& about, const std::string& text);
/// Texts with the same key are repeats of each other; of those held back the last is written.
void Write(Level level, const std::string& key, const std::string& text);
/// Never folded: an act of a person, of which each counts.
void WriteAct(Level level, const std::string& text);
void WriteAct(Level level, const About& about, const std::string& text);

/// As it is, without time and level. `text` ends with a line feed.
void Plain(const std::string& text);

/// Waits until the reader has taken all, half a second at most. An exit does it by itself.
void Flush();
/// Lines that neither the journal nor standard error took, or not in time.
std::uint64_t Dropped();

/// Tells at once what is held back, so that a log that ends here ends with the true state.
/// Thread-safe.
void TellRepeats();

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
template <typename... Args>
void Info(const About& about, fmt::format_string<Args...> form, Args&&... args) {
  Write(Level::info, about, fmt::format(form, std::forward<Args>(args)...));
}
template <typename... Args>
void Warn(const About& about, fmt::format_string<Args...> form, Args&&... args) {
  Write(Level::warning, about, fmt::format(form, std::forward<Args>(args)...));
}
template <typename... Args>
void Act(Level level, fmt::format_string<Args...> form, Args&&... args) {
  WriteAct(level, fmt::format(form, std::forward<Args>(args)...));
}
/// For texts in which something differs every time, such as the port of a client.
template <typename... Args>
void WarnFolded(const std::string& key, fmt::format_string<Args...> form, Args&&... args) {
  Write(Level::warning, key, fmt::format(form, std::forward<Args>(args)...));
}

}  // namespace baudgate::log
