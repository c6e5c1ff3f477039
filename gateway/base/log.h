// The log of the program: lines on standard error, one per change of state, each with its line and
// device. Logging never waits for the reader: if the buffer is full, a line is dropped and counted.
// A text that comes again within a minute is counted only, and its count is written when the minute
// is over.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace baudgate::log {

enum class Level { debug, info, warning, error };

/// The line and device that a log text is about. They precede the text ("line bay: device relay:
/// offline"), and are fields in the journal (LINE=, DEVICE=, OUTCOME=). `outcome`, the name of an
/// Outcome, is in the journal only.
struct About {
  std::string line{};
  std::string device{};
  std::string outcome{};
  /// Further fields for the journal, as name and value.
  std::vector<std::pair<std::string, std::string>> fields{};
};

/// Starts the log; called once by the main program. If standard error is systemd's journal, lines
/// go to its `socket` with priority and fields, but without the time.
void Begin(Level least, const std::string& socket = "/run/systemd/journal/socket");

/// Sets the lowest level that is written, for example while a live table is shown.
void SetLeast(Level least);

/// Writes a text. A text that was written less than a minute ago is only counted. Thread-safe.
void Write(Level level, const std::string& text);
void Write(Level level, const About& about, const std::string& text);
/// Texts with the same key count as repeats of each other. When a minute is over, the last of the
/// repeats is written.
void Write(Level level, const About& about, const std::string& key, const std::string& text);
/// Writes the text even if it is a repeat, because every act of a person counts.
void WriteAct(Level level, const std::string& text);
void WriteAct(Level level, const About& about, const std::string& text);

/// Writes `text`, which ends with a line feed, without time and level. Does nothing before Begin.
void Plain(const std::string& text);

/// Waits until the reader has taken all lines, at most half a second. At exit this happens
/// automatically.
void Flush();
/// Returns the number of lines that neither the journal nor standard error took in time.
std::uint64_t Dropped();

/// Writes all repeats that were held back, so that a log that ends here ends with the current
/// state. Thread-safe.
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
/// Writes a warning whose text differs every time, for example by the port of a client. Warnings
/// with the same `key` count as equal texts.
template <typename... Args>
void WarnFolded(const std::string& key, fmt::format_string<Args...> form, Args&&... args) {
  Write(Level::warning, {}, key, fmt::format(form, std::forward<Args>(args)...));
}
/// Like WarnFolded, for information about a line, such as a client that has its port.
template <typename... Args>
void InfoFolded(const About& about, const std::string& key, fmt::format_string<Args...> form,
                Args&&... args) {
  Write(Level::info, about, key, fmt::format(form, std::forward<Args>(args)...));
}

}  // namespace baudgate::log
