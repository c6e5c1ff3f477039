// `RenderTable` renders tables as text for a terminal: the live values of `baudgate watch` and
// `baudgate demo`, and the status.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate::tools {

// `LiveScreen` draws on the whole screen of a terminal. Its destructor restores the former content.
// Used by `demo`, `watch` and `status --watch`; works over ssh.
class LiveScreen {
 public:
  /// Checks that the terminal of `descriptor` can be drawn on. The error contains the reason: there
  /// is no terminal, or it can only print line after line (TERM=dumb).
  static Status Possible(int descriptor);

  /// `out` must write to a terminal, and outlive this object.
  explicit LiveScreen(std::ostream& out);
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;

  /// Replaces the drawn lines by at most `height` lines (0: all). If lines are left out, the last
  /// line shows how many. Writes only if the text has changed, and all at once, so that the screen
  /// does not flicker.
  void Draw(std::string_view lines, std::size_t height);

 private:
  std::ostream& out_;
  std::string drawn_;
};

/// The colour of a row, by severity.
enum class Tone : std::uint8_t { faint, plain, warning, alarm };

struct TableColumn {
  std::string title;
  bool right = false;       ///< right-aligned, for numbers
  bool spare = false;       ///< left out if the lines would be too wide
  std::size_t widest = 40;  ///< longer cells are cut with "…" if the width is limited
};

struct TableRow {
  std::vector<std::string> cells;
  Tone tone = Tone::plain;
};

struct TableView {
  std::size_t width = 0;  ///< characters in a line; 0 = no limit
  /// Number of lines with the head; 0: no limit. If rows do not fit, the last line tells how many.
  std::size_t height = 0;
  bool colour = false;
};

/// Renders a table as lines that each end in a line feed. Columns are as wide as the shown rows
/// need. If the lines would be wider than the view, spare columns are left out, the last first;
/// then text columns are cut, the widest first. Control characters in cells are replaced by '?', so
/// that data from a network cannot control the terminal.
std::string RenderTable(const std::vector<TableColumn>& columns, const std::vector<TableRow>& rows,
                        const TableView& view);

struct PointRow {
  std::string device;
  std::string point;
  std::string value;  ///< the value as config::ShownText returns it
  std::string unit;
  Quality quality = Quality::bad_waiting;
  std::optional<Duration> age;  ///< empty: the point was never read
  bool gone = false;            ///< true: the point's gateway no longer publishes it
  bool write_only = false;      ///< true: the point is never read, so it has no quality
};

/// The device's name is only in the first row of the device.
std::string RenderPoints(const std::vector<PointRow>& rows, const TableView& view);

/// Returns the size of the terminal of `descriptor`; nullopt: it is not a terminal. `colour` is
/// false if NO_COLOR is set.
std::optional<TableView> TerminalView(int descriptor);

/// Returns how many characters a line of the terminal has; 0: there is no terminal, and so no
/// limit.
std::size_t TerminalWidth(int descriptor);

}  // namespace baudgate::tools
