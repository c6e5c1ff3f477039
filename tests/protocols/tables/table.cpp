// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/tables/table.h"

#include <algorithm>
#include <array>
#include <optional>
#include <set>

#include "gateway/base/text.h"

namespace baudgate::testing {
namespace {

constexpr std::array<std::string_view, 3> kStandings = {"certain", "inferred", "unsourced"};

std::optional<Standing> StandingOf(std::string_view name) {
  const auto* at = std::find(kStandings.begin(), kStandings.end(), name);
  if (at == kStandings.end()) return std::nullopt;
  return static_cast<Standing>(at - kStandings.begin());
}

std::vector<std::string> Cells(std::string_view line) {
  std::vector<std::string> cells;
  for (const std::string_view cell : Split(line, '|')) {
    const std::string_view text = Trim(cell);
    cells.emplace_back(text == "-" ? "" : text);
  }
  return cells;
}

class Reader {
 public:
  Reader(const std::string& file, std::vector<std::string>& problems)
      : file_(file), problems_(problems) {}

  Table Read(std::string_view text) {
    for (const std::string_view line : Split(text, '\n')) {
      ++line_;
      const std::string_view trimmed = Trim(line);
      if (trimmed.empty() || trimmed.front() == '#') continue;
      const auto cells = Cells(trimmed);
      if (cells[0] == "option") {
        Option(cells);
      } else {
        Row(cells);
      }
    }
    return std::move(table_);
  }

 private:
  void Problem(const std::string& what) {
    problems_.push_back(file_ + ":" + std::to_string(line_) + ": " + what);
  }

  Standing ReadStanding(const std::string& name) {
    const auto standing = StandingOf(name);
    if (!standing) Problem("'" + name + "' is no standing: certain, inferred or unsourced");
    return standing.value_or(Standing::unsourced);
  }

  double Number(const std::string& text) {
    const auto number = ParseDecimal(text);
    if (!number) Problem("'" + text + "' is no number");
    return number.value_or(0);
  }

  void Option(const std::vector<std::string>& cells) {
    if (cells.size() != 5) return Problem("an option has 5 cells");
    if (cells[4].empty()) Problem("option " + cells[1] + " names no source");
    table_.options.push_back({cells[1], cells[2], ReadStanding(cells[3])});
  }

  void Row(const std::vector<std::string>& cells) {
    if (cells.size() != 11) return Problem("a point has 11 cells");
    if (!names_.insert(cells[0]).second) Problem("point " + cells[0] + " stands twice");
    if (cells[10].empty()) Problem("point " + cells[0] + " names no source");
    TableRow row = {cells[0],         cells[1],         cells[2], cells[3], cells[4],
                    Number(cells[5]), Number(cells[6]), {},       cells[8], ReadStanding(cells[9])};
    if (!cells[7].empty()) {
      for (const std::string_view value : Split(cells[7], ',')) {
        row.sentinels.push_back(Number(std::string(Trim(value))));
      }
    }
    table_.rows.push_back(std::move(row));
  }

  const std::string& file_;
  std::vector<std::string>& problems_;
  int line_ = 0;
  std::set<std::string> names_;
  Table table_;
};

}  // namespace

int Table::Count(Standing standing) const {
  const auto is = [standing](const auto& row) { return row.standing == standing; };
  return static_cast<int>(std::count_if(rows.begin(), rows.end(), is) +
                          std::count_if(options.begin(), options.end(), is));
}

Table ReadTable(std::string_view text, const std::string& file,
                std::vector<std::string>& problems) {
  return Reader(file, problems).Read(text);
}

}  // namespace baudgate::testing
