// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/live_table.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <span>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l\x1b[2J";  // alternate screen, no cursor
constexpr std::string_view kLeave = "\x1b[?25h\x1b[?1049l";

/// Returns the text that draws `lines` from the upper left corner on, and clears the rest of each
/// line and all lines below. The last line has no '\n', which would scroll.
std::string FrameOf(std::string_view lines, std::size_t height) {
  auto left = static_cast<std::size_t>(std::ranges::count(lines, '\n'));
  if (!lines.empty() && lines.back() != '\n') ++left;
  std::size_t room = height == 0 ? left : height;
  std::string frame = "\x1b[H";
  for (std::size_t at = 0; left > 0 && room > 0; --left, --room) {
    if (at > 0) frame += '\n';
    const std::size_t end = std::min(lines.find('\n', at), lines.size());
    const bool cut = room == 1 && left > 1;
    frame += cut ? "… " + std::to_string(left) + " more" : std::string(lines.substr(at, end - at));
    frame += "\x1b[K";
    at = end + 1;
  }
  return frame + "\x1b[J";
}

}  // namespace

Status LiveScreen::Possible(int descriptor) {
  if (::isatty(descriptor) == 0) return Error{"standard output is no terminal"};
  const char* const name = std::getenv("TERM");
  const std::string_view term = name == nullptr ? "" : name;
  if (!term.empty() && term != "dumb") return {};
  return Error{"this terminal cannot show a live table (TERM is " +
               (term.empty() ? "not set" : std::string(term)) + ")"};
}

LiveScreen::LiveScreen(std::ostream& out) : out_(out) { out_ << kEnter << std::flush; }

LiveScreen::~LiveScreen() { out_ << kLeave << std::flush; }

void LiveScreen::Draw(std::string_view lines, std::size_t height) {
  std::string frame = FrameOf(lines, height);
  if (frame == drawn_) return;
  out_ << frame << std::flush;
  drawn_ = std::move(frame);
}

namespace {

constexpr std::string_view kEllipsis = "\xE2\x80\xA6";
constexpr std::string_view kGap = "  ";

/// The minimum width of a column that is cut because the lines are too wide.
constexpr std::size_t kLeastText = 12;

std::string Cut(std::string_view text, std::size_t width) {
  if (WidthOf(text) <= width) return std::string(text);
  std::size_t end = 0;
  for (std::size_t seen = 0; end < text.size(); ++end) {
    if (!ContinuesCharacter(text[end]) && ++seen == width) break;
  }
  return width == 0 ? std::string() : std::string(text.substr(0, end)).append(kEllipsis);
}

std::string Padded(std::string_view cell, std::size_t width, bool right) {
  const std::string text = Cut(cell, width);
  const std::string blank(width - std::min(width, WidthOf(text)), ' ');
  return right ? blank + text : text + blank;
}

std::string_view ColourOf(Tone tone) {
  switch (tone) {
    case Tone::faint:
      return "\x1b[2m";
    case Tone::plain:
      return "";
    case Tone::warning:
      return "\x1b[33m";
    case Tone::alarm:
      return "\x1b[31m";
  }
  return "";
}

class Renderer {
 public:
  Renderer(const std::vector<TableColumn>& columns, std::span<const TableRow> rows,
           const TableView& view)
      : view_(view) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      std::size_t width = WidthOf(columns[i].title);
      const std::size_t widest = std::max(columns[i].widest, width);
      for (const TableRow& row : rows) {
        if (i < row.cells.size()) width = std::max(width, WidthOf(row.cells[i]));
      }
      columns_.push_back({&columns[i], i, view.width > 0 ? std::min(width, widest) : width});
    }
    if (view.width > 0) Fit();
  }

  std::string Line(const std::vector<std::string>& cells, Tone tone) const {
    std::string line;
    for (const Column& column : columns_) {
      const std::string cell =
          column.cell < cells.size() ? Harmless(cells[column.cell]) : std::string();
      if (!line.empty()) line += kGap;
      line += Padded(cell, column.width, column.is->right);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    if (view_.width > 0) line = Cut(line, view_.width);
    const std::string_view colour = view_.colour ? ColourOf(tone) : std::string_view();
    if (!colour.empty()) line = std::string(colour) + line + "\x1b[0m";
    return line + '\n';
  }

 private:
  struct Column {
    const TableColumn* is;
    std::size_t cell;
    std::size_t width;

    bool shrinks() const { return !is->right && width > std::max(kLeastText, WidthOf(is->title)); }
  };

  std::size_t width() const {
    std::size_t all = kGap.size() * (columns_.size() - 1);
    for (const Column& column : columns_) all += column.width;
    return all;
  }

  void Fit() {
    while (width() > view_.width) {
      const auto spare = std::find_if(columns_.rbegin(), columns_.rend(),
                                      [](const Column& column) { return column.is->spare; });
      if (spare == columns_.rend()) break;
      columns_.erase(std::next(spare).base());
    }
    while (width() > view_.width) {
      const auto widest = std::ranges::max_element(
          columns_, {}, [](const Column& column) { return column.shrinks() ? column.width : 0; });
      if (!widest->shrinks()) break;
      --widest->width;
    }
  }

  const TableView& view_;
  std::vector<Column> columns_;
};

Tone ToneOf(const PointRow& row) {
  if (row.gone || row.write_only || row.quality == Quality::bad_waiting) return Tone::faint;
  if (IsGood(row.quality)) return Tone::plain;
  return IsUncertain(row.quality) ? Tone::warning : Tone::alarm;
}

}  // namespace

std::string RenderTable(const std::vector<TableColumn>& columns, const std::vector<TableRow>& rows,
                        const TableView& view) {
  std::size_t shown = rows.size();
  // One line is needed for the head, and one for the number of rows that are left out.
  if (view.height > 0 && rows.size() + 1 > view.height) {
    shown = view.height > 2 ? view.height - 2 : 0;
  }
  const std::span<const TableRow> seen = std::span(rows).first(shown);
  const Renderer renderer(columns, seen, view);
  std::vector<std::string> titles;
  for (const TableColumn& column : columns) titles.push_back(column.title);
  std::string text = renderer.Line(titles, Tone::faint);
  for (const TableRow& row : seen) text += renderer.Line(row.cells, row.tone);
  if (shown < rows.size()) {
    text.append(kEllipsis)
        .append(" ")
        .append(std::to_string(rows.size() - shown))
        .append(" more\n");
  }
  return text;
}

std::string RenderPoints(const std::vector<PointRow>& rows, const TableView& view) {
  static const std::vector<TableColumn> kColumns = {
      {.title = "device"}, {.title = "point"},   {.title = "value", .right = true, .widest = 24},
      {.title = "unit"},   {.title = "quality"}, {.title = "age", .right = true}};
  std::vector<TableRow> table;
  table.reserve(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const PointRow& row = rows[i];
    const bool again = i > 0 && rows[i - 1].device == row.device;
    table.push_back({{again ? "" : row.device, row.point, row.value, row.unit,
                      row.gone         ? "gone"
                      : row.write_only ? "write only"
                                       : Name(row.quality),
                      row.age ? FormatAge(*row.age) : "-"},
                     ToneOf(row)});
  }
  return RenderTable(kColumns, table, view);
}

std::optional<TableView> TerminalView(int descriptor) {
  if (::isatty(descriptor) == 0) return std::nullopt;
  TableView view;
  winsize size{};
  if (::ioctl(descriptor, TIOCGWINSZ, &size) == 0) {
    view.width = size.ws_col;
    view.height = size.ws_row;
  }
  const char* no_colour = std::getenv("NO_COLOR");
  view.colour = no_colour == nullptr || *no_colour == '\0';
  return view;
}

std::size_t TerminalWidth(int descriptor) {
  return TerminalView(descriptor).value_or(TableView{}).width;
}

}  // namespace baudgate::tools
