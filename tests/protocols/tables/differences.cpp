// Compares a profile with the table of its device (tests/protocols/tables/table.h).
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>
#include <variant>

#include "gateway/base/text.h"
#include "tests/protocols/tables/table.h"

namespace baudgate::testing {
namespace {

std::string Shown(const std::string& text) { return text.empty() ? "nothing" : "'" + text + "'"; }

std::string TypeOf(const config::Point& point) {
  const std::string name(config::Name(point.type));
  if (point.type != config::Type::string) return name;
  return name + "(" + std::to_string(point.text_length) + ")";
}

bool TypeFits(const config::Point& point, const std::string& demanded) {
  if (point.type != config::Type::string || !demanded.starts_with("string")) {
    return TypeOf(point) == demanded;
  }
  if (demanded == "string") return true;
  const auto least = ParseInteger<std::size_t>(
      std::string_view(demanded).substr(7, demanded.size() - 8));  // between the parentheses
  return least && point.text_length >= *least;
}

std::string Numbers(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + FormatNumber(value);
  return text;
}

std::string SentinelsOf(const config::Point& point) {
  std::vector<double> values;
  for (const config::Sentinel& sentinel : point.sentinels)
    values.push_back(sentinel.value.ToDouble());
  return Numbers(std::move(values));
}

std::vector<std::string> ItemsOf(const config::OptionValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return {*flag ? "true" : "false"};
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return {std::to_string(*whole)};
  if (const auto* real = std::get_if<double>(&value)) return {FormatNumber(*real)};
  if (const auto* text = std::get_if<std::string>(&value)) return {*text};
  if (const auto* pairs = std::get_if<config::Pairs>(&value)) {
    std::vector<std::string> items;
    for (const auto& [word, text] : *pairs) items.push_back(word + "=" + text);
    return items;
  }
  if (std::holds_alternative<config::DescriptionRef>(value)) return {"described"};
  return std::get<std::vector<std::string>>(value);
}

bool OptionFits(const std::vector<std::string>& items, const std::string& demanded) {
  const auto wanted = Split(demanded, ',');
  return std::equal(items.begin(), items.end(), wanted.begin(), wanted.end(),
                    [](const std::string& item, std::string_view begin) {
                      begin = Trim(begin);
                      return item.starts_with(begin) &&
                             (item.size() == begin.size() || item[begin.size()] == ' ');
                    });
}

class Comparison {
 public:
  Comparison(const config::Profile& profile, const Table& table)
      : profile_(profile), table_(table) {}

  std::vector<std::string> Run() {
    for (const config::Point& point : profile_.points) {
      if (const TableRow* row = RowOf(point.name)) {
        Compare(point, *row);
      } else {
        Say("point " + point.name + ": not in the table");
      }
    }
    for (const TableRow& row : table_.rows) {
      const bool there =
          std::any_of(profile_.points.begin(), profile_.points.end(),
                      [&](const config::Point& point) { return point.name == row.point; });
      if (!there) Say("point " + row.point + ": in the table, but not in the profile");
    }
    CompareOptions();
    return std::move(differences_);
  }

 private:
  void Say(const std::string& what) {
    differences_.push_back(profile_.protocol + "/" + profile_.name + ": " + what);
  }

  const TableRow* RowOf(const std::string& point) const {
    const auto at = std::find_if(table_.rows.begin(), table_.rows.end(),
                                 [&](const TableRow& row) { return row.point == point; });
    return at == table_.rows.end() ? nullptr : &*at;
  }

  void Field(const config::Point& point, const std::string& field, const std::string& given,
             const std::string& demanded, bool fits) {
    if (fits) return;
    Say("point " + point.name + ": " + field + " is " + Shown(given) + ", the table says " +
        Shown(demanded));
  }
  void Field(const config::Point& point, const std::string& field, const std::string& given,
             const std::string& demanded) {
    Field(point, field, given, demanded, given == demanded);
  }

  void Compare(const config::Point& point, const TableRow& row) {
    Field(point, "read", point.read, row.read);
    Field(point, "write", point.write, row.write);
    Field(point, "type", TypeOf(point), row.type, TypeFits(point, row.type));
    Field(point, "unit", point.unit, row.unit);
    Field(point, "scale", point.scale.ToText(), FormatNumber(row.scale));
    Field(point, "offset", point.offset.ToText(), FormatNumber(row.offset));
    Field(point, "sentinels", SentinelsOf(point), Numbers(row.sentinels));
    Field(point, "access", std::string(config::Name(point.access)), row.access);
  }

  void CompareOptions() {
    for (const auto& [name, value] : profile_.options.all()) {
      const auto at = std::find_if(table_.options.begin(), table_.options.end(),
                                   [&](const TableOption& option) { return option.name == name; });
      if (at == table_.options.end()) {
        Say("option " + name + ": not in the table");
        continue;
      }
      std::string given;
      for (const std::string& item : ItemsOf(value)) given += (given.empty() ? "" : ", ") + item;
      if (!OptionFits(ItemsOf(value), at->value)) {
        Say("option " + name + ": is " + Shown(given) + ", the table says " + Shown(at->value));
      }
    }
    for (const TableOption& option : table_.options) {
      if (profile_.options.Has(option.name)) continue;
      Say("option " + option.name + ": in the table, but not in the profile");
    }
  }

  const config::Profile& profile_;
  const Table& table_;
  std::vector<std::string> differences_;
};

}  // namespace

std::vector<std::string> Differences(const config::Profile& profile, const Table& table) {
  return Comparison(profile, table).Run();
}

}  // namespace baudgate::testing
