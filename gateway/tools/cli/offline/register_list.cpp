// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/register_list.h"

#include <algorithm>
#include <map>

#include "config/checks/uniques.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/tools/cli/offline/new_profile.h"

namespace baudgate::tools {
namespace {

std::size_t EndOfRegisters(const ListedPoint& point) {
  return std::size_t{point.address} + RegistersOf(point.form);
}

std::string RegistersText(const ListedPoint& point) {
  const std::string first = point.table + " " + std::to_string(point.address);
  const std::size_t last = EndOfRegisters(point) - 1;
  return last == point.address ? first : first + "…" + std::to_string(last);
}

/// Finds points whose registers overlap. Adds an error for a partial overlap, and a warning if the
/// registers are the same. `file` is the list's name in messages.
void CheckPlaces(const std::string& file, RegisterList& list) {
  std::vector<const ListedPoint*> points;
  for (const ListedPoint& point : list.points) points.push_back(&point);
  std::ranges::stable_sort(points, [](const ListedPoint* a, const ListedPoint* b) {
    return a->table != b->table ? a->table < b->table : a->address < b->address;
  });
  const ListedPoint* before = nullptr;  // the point of the same table that reaches farthest so far
  for (const ListedPoint* point : points) {
    const bool shared = before != nullptr && before->table == point->table &&
                        point->address < EndOfRegisters(*before);
    if (shared) {
      const bool same =
          before->address == point->address && EndOfRegisters(*before) == EndOfRegisters(*point);
      const std::string text = file + ":" + std::to_string(point->line) + ": " +
                               Quoted(point->name) + " (" + RegistersText(*point) + ") ";
      const std::string other = Quoted(before->name) + " in line " + std::to_string(before->line);
      if (same) {
        list.warnings.push_back(text + "reads the same register as " + other);
      } else {
        list.errors.push_back(text + "overlaps " + other + " (" + RegistersText(*before) +
                              "); correct the register or type of one point");
      }
    }
    const bool farther = before == nullptr || before->table != point->table ||
                         EndOfRegisters(*point) > EndOfRegisters(*before);
    if (farther) before = point;
  }
}

struct Register {
  std::string table;  // empty: the list tells no table for this register
  std::uint16_t address = 0;
  std::optional<std::size_t> count;  // number of registers; empty: the list gives no range
};

std::optional<std::uint32_t> Number(std::string_view text) {
  text = Trim(text);
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  return hex ? ParseInteger<std::uint32_t>(text.substr(2), 16) : ParseInteger<std::uint32_t>(text);
}

/// Replaces dashes of all kinds, "…", "~" and "to" by '-', as in "40003 – 40004".
std::string WithPlainDashes(std::string text) {
  static constexpr std::string_view kDashes[] = {"\u2010", "\u2011", "\u2012", "\u2013", "\u2014",
                                                 "\u2015", "\u2212", "\u2026", "\u00AD", "\uFF0D",
                                                 "\uFE58", "~",      "\uFF5E", " to "};
  for (const std::string_view dash : kDashes) {
    for (auto at = text.find(dash); at != std::string::npos; at = text.find(dash, at)) {
      text.replace(at, dash.size(), "-");
    }
  }
  return text;
}

struct Range {
  std::uint32_t first = 0;
  std::optional<std::size_t> count;  // number of registers; empty: the text gives no last number
};

/// Parses a register or a range of registers. Examples: "40003", "40003-40004", "40003..40004",
/// "40003-4".
std::optional<Range> RangeOf(std::string_view text) {
  text = Trim(text);
  const auto dash = text.find_first_of("-.", 1);
  const std::string_view begin = Trim(text.substr(0, dash));
  const auto first = Number(begin);
  if (!first) return std::nullopt;
  if (dash == std::string_view::npos) return Range{*first, {}};
  const std::string_view end = Trim(text.substr(text.find_last_of("-.") + 1));
  auto last = Number(end);
  if (last && *last < *first && end.size() < begin.size()) {
    last = Number(std::string(begin.substr(0, begin.size() - end.size())) + std::string(end));
  }
  if (!last || *last < *first) return std::nullopt;
  return Range{*first, *last - *first + 1};
}

/// Parses a scale. Examples: "0.1", "0,1", "1E-05", "/10", "1/10".
std::optional<Decimal> ScaleOf(const std::string& text) {
  const auto slash = text.find('/');
  if (slash == std::string::npos) return ListedNumber(text);
  const auto above = slash == 0 ? Decimal(1) : ListedNumber(text.substr(0, slash));
  const auto below = ListedNumber(text.substr(slash + 1));
  if (!above || !below || *below == 0) return std::nullopt;
  return *above / *below;
}

/// True for a name such as "VoltageL1", which keeps its capitals because they make it readable.
bool IsCamelCase(std::string_view text) {
  const auto lower = [](char c) { return c >= 'a' && c <= 'z'; };
  for (std::size_t i = 1; i < text.size(); ++i) {
    if (lower(text[i - 1]) && text[i] >= 'A' && text[i] <= 'Z') return true;
  }
  return false;
}

/// Returns a valid point name. Example: "Voltage L1-N" → "voltage_l1_n".
std::string PointName(std::string_view text) {
  std::string name;
  for (const char c : Lower(text)) {
    const bool word = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (word) {
      name += c;
    } else if (!name.empty() && name.back() != '_') {
      name += '_';
    }
  }
  while (name.ends_with('_')) name.pop_back();
  if (!name.empty() && name.front() >= '0' && name.front() <= '9') name.insert(0, "p");
  return name.substr(0, 60);
}

/// Returns table and address of a number of five or six digits. Example: 40001 → holding 0.
std::optional<Register> Modicon(std::uint32_t number) {
  const bool six = number > 100'000;
  const std::uint32_t size = six ? 100'000 : 10'000;
  const std::uint32_t in_table = number % size;
  if (in_table == 0 || in_table > 65'536) return std::nullopt;
  static constexpr std::string_view kTables[] = {"coil", "discrete", "", "input", "holding"};
  const std::uint32_t digit = number / size;
  if (digit >= std::size(kTables) || kTables[digit].empty()) return std::nullopt;
  return Register{std::string(kTables[digit]), static_cast<std::uint16_t>(in_table - 1), {}};
}

class ListReader {
 public:
  ListReader(std::string file, std::string table, std::optional<FirstRegister> first)
      : file_(std::move(file)), table_(std::move(table)), first_(first) {}

  RegisterList Read(const std::string& text) {
    const CsvTable csv = ReadCsv(text);
    if (csv.rows.empty()) {
      list_.errors.push_back(file_ + " is empty");
      return std::move(list_);
    }
    separator_ = csv.separator;
    ReadHeader(csv.rows.front());
    if (!list_.errors.empty()) return std::move(list_);
    for (std::size_t i = 1; i < csv.rows.size(); ++i) {
      if (HasItsColumns(csv.rows[i])) ReadRow(csv.rows[i]);
    }
    if (csv.rows.size() == 1)
      Error(csv.rows.front().line, "no row follows the header; add one row for each point");
    if (lowest_) {
      list_.numbers = std::to_string(*lowest_);
      if (highest_ != *lowest_) list_.numbers += "…" + std::to_string(highest_);
      CheckCounting();
    }
    if (first_ || list_.numbers.empty()) CheckPlaces(file_, list_);
    return std::move(list_);
  }

 private:
  void Error(int line, const std::string& text) {
    list_.errors.push_back(file_ + ":" + std::to_string(line) + ": " + text);
  }

  void ReadHeader(const CsvRow& row) {
    width_ = row.cells.size();
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      const auto column = ColumnNamed(row.cells[i]);
      if (column && !columns_.emplace(*column, i).second) {
        Error(row.line, "column " + Quoted(row.cells[i]) +
                            " occurs twice, or under two names; remove one of the two columns");
      }
      if (!column && !row.cells[i].empty()) {
        list_.warnings.push_back(file_ + ":" + std::to_string(row.line) + ": column " +
                                 Quoted(row.cells[i]) + " is not used");
      }
    }
    for (const auto& [column, word] : {std::pair{ListColumn::name, "name"},
                                       {ListColumn::address, "register"},
                                       {ListColumn::type, "type"}}) {
      if (columns_.contains(column)) continue;
      Error(row.line,
            "no column '" + std::string(word) +
                "'; the first row must name the columns: name, register, type, and optionally "
                "unit, scale, access, table, order, group, description, example");
    }
  }

  std::string Cell(const CsvRow& row, ListColumn column) const {
    const auto found = columns_.find(column);
    const bool there = found != columns_.end() && found->second < row.cells.size();
    return there ? row.cells[found->second] : std::string();
  }

  /// False if the row has a cell with content behind the last column of the header. This adds an
  /// error, because a cell contains a separator and is not quoted.
  bool HasItsColumns(const CsvRow& row) {
    const bool more =
        row.cells.size() > width_ &&
        std::ranges::any_of(row.cells.begin() + static_cast<std::ptrdiff_t>(width_),
                            row.cells.end(), [](auto& cell) { return !cell.empty(); });
    if (!more) return true;
    Error(row.line, "there are " + std::to_string(row.cells.size()) + " cells, and " +
                        std::to_string(width_) + " columns; " + HintOfSeparator());
    return false;
  }

  std::string HintOfSeparator() const {
    if (separator_ == ',') {
      return "write a number with a decimal comma in quotes, \"0,1\", or separate the cells by "
             "semicolons";
    }
    return "put a cell in quotes if it contains the separator";
  }

  /// Warns if the register numbers look like the 40001 notation although the user has given another
  /// notation.
  void CheckCounting() {
    if (!first_ || *first_ == FirstRegister::modicon) return;
    const auto within = [&](std::uint32_t from, std::uint32_t to) {
      return *lowest_ >= from && highest_ <= to;
    };
    if (!within(30'001, 39'999) && !within(40'001, 49'999)) return;
    const std::uint32_t base = *first_ == FirstRegister::one ? 1 : 0;
    list_.warnings.push_back(
        file_ + ": register " + std::to_string(*lowest_) + " is taken for address " +
        std::to_string(*lowest_ - base) +
        " on the wire; if 40001 is the first holding register, add --first-register 40001");
  }

  void ReadRow(const CsvRow& row) {
    ListedPoint point;
    point.line = row.line;
    const std::size_t before = list_.errors.size();
    ReadName(row, point);
    ReadForm(row, point);
    ReadRegister(row, point);
    ReadOrder(row, point);
    ReadScale(row, point);
    ReadRest(row, point);
    if (list_.errors.size() == before) list_.points.push_back(std::move(point));
  }

  void ReadName(const CsvRow& row, ListedPoint& point) {
    const std::string given = Cell(row, ListColumn::name);
    point.description = Cell(row, ListColumn::description);
    const bool usable = config::CheckPointName(given).ok();
    point.name = PointName(given);
    if (usable) point.name = IsCamelCase(given) ? given : Lower(given);
    if (point.name.empty()) {
      Error(row.line, given.empty() ? "no name"
                                    : "name " + Quoted(given) +
                                          " has no ASCII letter or digit; write another name");
      return;
    }
    if (!usable && point.description.empty()) point.description = given;
    const auto [first, is_new] = names_.emplace(Lower(point.name), row.line);
    if (!is_new) {
      Error(row.line, "point " + Quoted(point.name) + " occurs twice, first in line " +
                          std::to_string(first->second) + "; give one of them another name");
    }
  }

  void ReadForm(const CsvRow& row, ListedPoint& point) {
    const std::string given = Cell(row, ListColumn::type);
    const auto form = FormNamed(given);
    if (!form) {
      Error(row.line,
            given.empty()
                ? std::string("no type; write for example uint16")
                : "type " + Quoted(given) +
                      " is unknown; write bool, int8, uint8, int16, uint16, int32, uint32, "
                      "int64, uint64, float32, float64, bcd16, bcd32, string(n), TIME, DATE, TOD "
                      "or DT");
      return;
    }
    point.form = *form;
  }

  std::string ReadTable(const CsvRow& row) {
    const std::string given = Cell(row, ListColumn::table);
    if (given.empty()) return "";
    const auto table = TableNamed(given);
    if (!table) {
      Error(row.line, "table " + Quoted(given) +
                          " is unknown; write coil, discrete, holding or input, or the function "
                          "that reads it: 1, 2, 3 or 4");
    }
    return table.value_or("");
  }

  /// Parses the register of a row. Examples: "holding 12", "40013", "40013-40014".
  std::optional<Register> ParseRegister(const std::string& given) {
    const std::string text = WithPlainDashes(given);
    const auto blank = text.find(' ');
    if (blank != std::string::npos) {
      const auto table = TableNamed(text.substr(0, blank));
      const bool word = table && Lower(text).starts_with(*table);
      const auto range = word ? RangeOf(text.substr(blank)) : std::nullopt;
      if (range && range->first <= 65'535) {
        return Register{*table, static_cast<std::uint16_t>(range->first), range->count};
      }
    }
    const auto range = RangeOf(text);
    if (!range) return std::nullopt;
    lowest_ = std::min(lowest_.value_or(range->first), range->first);
    highest_ = std::max(highest_, range->first);
    auto place = Place(range->first);
    if (place) place->count = range->count;
    return place;
  }

  std::optional<Register> Place(std::uint32_t number) const {
    if (!first_) return Register{};  // the caller asks the user for `first`
    if (*first_ == FirstRegister::modicon) return Modicon(number);
    const std::uint32_t base = *first_ == FirstRegister::one ? 1 : 0;
    if (number < base || number - base > 65'535) return std::nullopt;
    return Register{"", static_cast<std::uint16_t>(number - base), {}};
  }

  void ReadRegister(const CsvRow& row, ListedPoint& point) {
    const std::string given = Cell(row, ListColumn::address);
    const std::string column = ReadTable(row);
    if (given.empty()) return Error(row.line, "no register");
    const auto place = ParseRegister(given);
    if (!place) {
      const bool modicon = first_ == FirstRegister::modicon;
      return Error(row.line,
                   "register " + Quoted(given) + " is not valid" +
                       (modicon ? ". Write 40001 to 49999 (or 400001 to 465536) for a holding "
                                  "register; input registers begin at 30001 (300001), discrete "
                                  "inputs at 10001 (100001), coils at 1"
                                : "; write a number, or for example 'input 3'"));
    }
    if (!place->table.empty() && !column.empty() && place->table != column) {
      return Error(row.line, "register " + Quoted(given) + " is of table " + place->table +
                                 ", but column 'table' has " + column + "; correct one of the two");
    }
    point.address = place->address;
    point.table = !place->table.empty() ? place->table : column;
    const bool bit = point.form == "bool";
    if (point.table.empty() && bit) {
      return Error(row.line,
                   "a bool needs its table; write coil or discrete in a column 'table', "
                   "or read a bit of a register: 'holding 8[b3]' in the profile");
    }
    if (point.table.empty()) point.table = table_;
    const bool bits = point.table == "coil" || point.table == "discrete";
    if (!point.form.empty() && bits != bit) {
      return Error(row.line, "type " + point.form + " does not fit table " + point.table +
                                 (bits ? "; write bool" : "; write a number's type"));
    }
    if (point.form == "string") {
      if (!place->count) {
        return Error(row.line,
                     "type string has no length; write for example string(16), or all of its "
                     "registers: 40001-40008");
      }
      point.form = "string(" + std::to_string(2 * *place->count) + ")";
    }
    if (place->count && !point.form.empty() && *place->count != RegistersOf(point.form)) {
      Error(row.line, "type " + point.form + " takes " +
                          Plural(RegistersOf(point.form), "register") + ", and " + Quoted(given) +
                          " are " + std::to_string(*place->count));
    }
  }

  /// Reads the byte order. A single register has no word order, although lists often give one.
  void ReadOrder(const CsvRow& row, ListedPoint& point) {
    const std::string given = WithPlainDashes(Cell(row, ListColumn::order));
    if (given.empty() || given == "-" || point.form.empty() || point.form == "bool") return;
    const auto order = OrderNamed(given);
    if (!order) {
      return Error(row.line, "order " + Quoted(given) +
                                 " is unknown or ambiguous; write ABCD (high word first), CDAB "
                                 "(low word first), BADC or DCBA (the same with the bytes of each "
                                 "register swapped)");
    }
    const bool words = RegistersOf(point.form) > 1 && !point.form.starts_with("string");
    if (words || *order == "BADC") point.order = *order;
    if (!words && *order == "DCBA") {
      Error(row.line, "order DCBA: type " + point.form +
                          " has no words to swap; write BADC if the bytes of each register are "
                          "swapped, else leave the cell empty");
    }
  }

  void ReadScale(const CsvRow& row, ListedPoint& point) {
    const std::string given = Cell(row, ListColumn::scale);
    if (!given.empty()) {
      const auto scale = ScaleOf(given);
      if (!scale || *scale == 0) {
        return Error(row.line, "scale " + Quoted(given) +
                                   " is not a number, or is 0; write the factor of the raw value, "
                                   "for example 0.1 or 1/10" +
                                   (separator_ == ',' ? "; " + HintOfSeparator() : ""));
      }
      point.scale = *scale;
    }
    const bool number =
        point.form != "bool" && !point.form.starts_with("string") && !IsTimeForm(point.form);
    if (point.scale != 1 && !number) {
      return Error(row.line, "scale: only numbers can have a scale, but the type is " + point.form +
                                 "; leave the cell empty");
    }
    point.type = TypeOf(point.form, point.scale);
    point.registers = point.form == "bool" ? 1 : RegistersOf(point.type);
  }

  /// Returns the type of the point for registers of this form. A scaled value needs a type that can
  /// represent all digits of the raw number.
  static std::string TypeOf(const std::string& form, const Decimal& scale) {
    const bool kept = form.starts_with("float") || form.starts_with("string") || form == "bool";
    if (kept || IsTimeForm(form)) return form;
    const std::size_t registers = RegistersOf(form);
    if (!scale.is_whole()) return registers == 1 ? "float32" : "float64";
    if (scale != 1) return "int64";
    if (form == "bcd16") return "uint16";
    return form == "bcd32" ? "uint32" : form;
  }

  void ReadRest(const CsvRow& row, ListedPoint& point) {
    point.unit = Cell(row, ListColumn::unit);
    if (WithPlainDashes(point.unit) == "-") point.unit.clear();
    point.group = Lower(Cell(row, ListColumn::group));
    if (const std::string given = Cell(row, ListColumn::access); !given.empty()) {
      const auto access = AccessNamed(given);
      if (!access) Error(row.line, "access " + Quoted(given) + " is unknown; write r, w or rw");
      point.access = access.value_or("r");
    }
    const bool written = point.access != "r";
    if (written && (point.table == "input" || point.table == "discrete")) {
      Error(row.line, "access: table " + point.table + " is read-only; write r");
    }
    if (const std::string given = Cell(row, ListColumn::example);
        !given.empty() && !point.form.empty()) {
      const auto simulate = ListedExample(given, point.form, point.scale);
      if (!simulate) return Error(row.line, "example " + Quoted(given) + " " + simulate.error());
      point.simulate = *simulate;
    }
  }

  const std::string file_;
  const std::string table_;
  const std::optional<FirstRegister> first_;
  std::map<ListColumn, std::size_t> columns_;
  std::map<std::string, int> names_;
  std::optional<std::uint32_t> lowest_;
  std::uint32_t highest_ = 0;
  char separator_ = ',';
  std::size_t width_ = 0;
  RegisterList list_;
};

}  // namespace

RegisterList ReadRegisterList(const std::string& text, const std::string& file,
                              const std::string& table, std::optional<FirstRegister> first) {
  return ListReader(file, table, first).Read(text);
}

}  // namespace baudgate::tools
