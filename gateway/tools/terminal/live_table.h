// `RenderTable` renders tables of live values, for `baudgate watch` and `baudgate demo`.
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

// `LiveScreen` uses the whole screen; its destructor restores the former content. Works over ssh.
class LiveScreen {
 public:
  /// Fails without a terminal, or if it can only print line after line (TERM=dumb).
  static Status Possible(int descriptor);

  /// `out` must write to a terminal, and outlive this object.
  explicit LiveScreen(std::ostream& out);
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;

  /// Draws at most `height` lines (0: all); the last shows how many are left out. Writes only
  /// changed text, all at once, so that the screen does not flicker.
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
  /// Number of lines, with the head; 0: no limit. Rows that do not fit are counted.
  std::size_t height = 0;
  bool colour = false;
};

/// If lines are too wide, leaves out spare columns, the last first, then cuts text columns, the
/// widest first. Replaces control characters by '?', so that data from a network cannot control the
/// terminal.
std::string RenderTable(const std::vector<TableColumn>& columns, const std::vector<TableRow>& rows,
                        const TableView& view);

struct PointRow {
  std::string device;
  std::string point;
  std::string value;  ///< the value as FormatValue returns it
  std::string unit;
  Quality quality = Quality::bad_waiting;
  std::optional<Duration> age;  ///< empty: the point was never read
  bool gone = false;            ///< the point's gateway no longer publishes it
};

/// The device's name is only in its first row.
std::string RenderPoints(const std::vector<PointRow>& rows, const TableView& view);

/// nullopt: `descriptor` is not a terminal. `colour` is false if NO_COLOR is set.
std::optional<TableView> TerminalView(int descriptor);

/// In characters; 0: there is no terminal, and so no limit.
std::size_t TerminalWidth(int descriptor);

}  // namespace baudgate::tools
