// Renders tables of live values as text: rows in, text out. `baudgate watch` and `baudgate demo`
// fill it from samples; the text goes to a terminal. LiveScreen is the whole screen, drawn again
// and again.
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

// The whole screen of a terminal for something that is drawn again and again, and as it was before
// when that ends. For `demo`, `watch` and `status --watch`; works over ssh, without a mouse.
class LiveScreen {
 public:
  /// The error says why nothing can be drawn there: it is no terminal, or one that can only print
  /// line after line (TERM=dumb).
  static Status Possible(int descriptor);

  /// `out` goes to a terminal and outlives it.
  explicit LiveScreen(std::ostream& out);
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;

  /// Lines in place of those before, at most `height` (0: all): the last of them says how many more
  /// there are. In one piece, and only where something is another: nothing flickers.
  void Draw(std::string_view lines, std::size_t height);

 private:
  std::ostream& out_;
  std::string drawn_;
};

/// How a row looks where colours are wanted; by trouble, the least first.
enum class Tone : std::uint8_t { faint, plain, warning, alarm };

struct TableColumn {
  std::string title;
  bool right = false;       ///< numbers
  bool spare = false;       ///< left out where lines would be too wide
  std::size_t widest = 40;  ///< longer cells are cut with "…" where lines have a limit
};

struct TableRow {
  std::vector<std::string> cells;
  Tone tone = Tone::plain;
};

struct TableView {
  std::size_t width = 0;   ///< characters a line; 0 = no limit
  std::size_t height = 0;  ///< lines, head included; 0 = no limit. What does not fit is counted.
  bool colour = false;
};

/// As wide as the rows that are shown need. Lines that each end in '\n'. Where they would be wider
/// than the view, spare columns are left out, the last first; then columns of text are cut, the
/// widest of them most. Control characters in cells become '?': what comes from a network must not
/// steer the terminal.
std::string RenderTable(const std::vector<TableColumn>& columns, const std::vector<TableRow>& rows,
                        const TableView& view);

/// One point as it is shown.
struct PointRow {
  std::string device;
  std::string point;
  std::string value;  ///< see FormatValue
  std::string unit;
  Quality quality = Quality::bad_waiting;
  std::optional<Duration> age;  ///< empty: never read
  bool gone = false;            ///< its gateway has left
};

/// Device, point, value, unit, quality and age; a device's name stands in its first row only.
std::string RenderPoints(const std::vector<PointRow>& rows, const TableView& view);

/// The size of the terminal behind `descriptor`; 0 by 0 and no colour when there is none.
/// Colours are left out where NO_COLOR is set.
std::optional<TableView> TerminalView(int descriptor);

/// Characters a line of it; 0: there is none, and no limit.
std::size_t TerminalWidth(int descriptor);

}  // namespace baudgate::tools
