// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/new_profile.h"

#include <algorithm>
#include <filesystem>

#include "config/loader.h"
#include "config/points.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/base/whole_file.h"
#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/cli/offline/listed_words.h"

namespace baudgate {

namespace {

/// A float of 64 bits has no more.
constexpr int kMostPlaces = 308;

template <typename Unit>
Decimal CountOf(WallTime time) {
  return Decimal(std::chrono::floor<Unit>(time.time_since_epoch()).count());
}

/// A date or time as a manual prints it.
std::optional<Decimal> TimeNumber(const std::string& text, const std::string& form) {
  if (form == "TIME") {
    const auto span = ParseDuration(text);
    return span ? std::optional(Decimal(*span / 1ms)) : std::nullopt;
  }
  const auto time = ParseWallTime(form == "TOD" ? "1970-01-01T" + text : text);
  if (!time) return std::nullopt;
  return form == "TOD" ? CountOf<std::chrono::milliseconds>(*time)
                       : CountOf<std::chrono::seconds>(*time);
}

/// The range of an integer in these registers; empty: they hold a float.
std::optional<config::IntegerRange> RangeOfForm(const std::string& form) {
  if (form == "bcd16") return config::IntegerRange{0, 9'999};
  if (form == "bcd32") return config::IntegerRange{0, 99'999'999};
  const auto type = config::ParseType(form);
  if (!type || form.starts_with("float")) return std::nullopt;
  return config::RangeOf(type->type);
}

const char* Like(const std::string& form) {
  if (form == "TIME") return "90s, or milliseconds";
  if (form == "TOD") return "14:30:00, or milliseconds since midnight";
  if (form == "DATE") return "2026-11-27, or seconds since 1970";
  if (form == "DT") return "2026-11-27T14:30:00, or seconds since 1970";
  return form == "bool" ? "0 or 1" : "230.4";
}

}  // namespace

std::optional<Decimal> ListedNumber(const std::string& text) {
  const auto e = text.find_first_of("eE");
  const bool exponent = e != std::string::npos && !text.starts_with("0x");
  const std::string digits = text.substr(0, exponent ? e : std::string::npos);
  const std::string with_point = WithDecimalPoint(digits);
  const auto number = Decimal::Parse(with_point.empty() ? digits : with_point);
  if (!number || !exponent) return number;
  const std::size_t from = text.find('+', e) == e + 1 ? e + 2 : e + 1;
  const auto places = ParseInteger<int>(std::string_view(text).substr(from));
  if (!places || *places > kMostPlaces || *places < -kMostPlaces) return std::nullopt;
  return number->Shifted(*places);
}

Result<std::string> ListedExample(const std::string& text, const std::string& form,
                                  const Decimal& scale) {
  if (form.starts_with("string")) {
    if (text.size() > LengthOf(form)) return Error{"is longer than " + form};
    return InQuotes(text);
  }
  auto number = ListedNumber(text);
  if (!number && IsTimeForm(form)) number = TimeNumber(text, form);
  if (!number) {
    return Error{"is none of type " + form + "; write for example " + std::string(Like(form))};
  }
  const Decimal raw = *number / scale;
  const auto range = RangeOfForm(form);
  if (range && !range->Contains(raw)) {
    return Error{"is " + raw.ToText() + " in the device, and " + form + " holds " +
                 Decimal(range->lowest).ToText() + " to " + Decimal(range->highest).ToText()};
  }
  return raw.ToText();
}

namespace {

/// Whose profiles modbus_tcp and modbus_ascii use, too.
constexpr const char* kProtocol = "modbus_rtu";

/// Windows-1252 from 0x80 to 0x9F: dashes, quotes and the euro.
constexpr std::string_view kOfWindows[] = {
    "\u20AC", "?",      "\u201A", "\u0192", "\u201E", "\u2026", "\u2020", "\u2021",
    "\u02C6", "\u2030", "\u0160", "\u2039", "\u0152", "?",      "\u017D", "?",
    "?",      "\u2018", "\u2019", "\u201C", "\u201D", "\u2022", "\u2013", "\u2014",
    "\u02DC", "\u2122", "\u0161", "\u203A", "\u0153", "?",      "\u017E", "\u0178"};

/// Spreadsheets write UTF-8, or the code page of Western Europe.
std::string AsUtf8(const std::string& text) {
  if (FirstNotUtf8(text) == std::string::npos) return text;
  std::string utf8;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      utf8 += c;
      continue;
    }
    if (byte < 0xA0) {
      utf8 += kOfWindows[byte - 0x80];
      continue;
    }
    utf8 += static_cast<char>(0xC0U | (byte >> 6U));
    utf8 += static_cast<char>(0x80U | (byte & 0x3FU));
  }
  return utf8;
}

/// Points follow each other in the gateway's own registers and bits.
class Places {
 public:
  std::size_t Next(const ListedPoint& point) {
    std::size_t& next = point.form == "bool" ? bit_ : register_;
    const std::size_t place = next;
    next += point.registers;
    return place;
  }

 private:
  std::size_t register_ = 0;
  std::size_t bit_ = 0;
};

std::string PointLine(const ListedPoint& point, std::size_t modbus) {
  std::string read = point.table + " " + std::to_string(point.address);
  if (point.form != "bool" && point.form != point.type) read += " " + point.form;
  if (!point.order.empty()) read += " " + point.order;
  std::string line = "  - { name: " + point.name + ", read: " + InQuotes(read);
  line += ", type: " + point.type;
  if (point.scale != 1) line += ", scale: " + point.scale.ToText();
  if (!point.unit.empty()) line += ", unit: " + InQuotes(point.unit);
  if (point.access != "r") line += ", access: " + point.access;
  if (!point.group.empty()) line += ", group: " + point.group;
  line += ", modbus: " + std::to_string(modbus);
  if (point.simulate) line += ", simulate: " + *point.simulate;
  if (!point.description.empty()) line += ", description: " + InQuotes(point.description);
  return line + " }\n";
}

std::string ProfileText(const RegisterList& list, const NewProfileOptions& options) {
  const std::filesystem::path file = options.file;
  const std::string title = options.title.empty() ? file.stem().string() : options.title;
  std::string text = "# Points of " + file.filename().string() +
                     ". Addresses behind `read` are those on the wire: the first register is 0.\n"
                     "device: " +
                     InQuotes(title) + "\npoints:\n";
  Places places;
  for (const ListedPoint& point : list.points) text += PointLine(point, places.Next(point));
  return text;
}

void AskForFirst(const RegisterList& list, const NewProfileOptions& options, std::ostream& err) {
  err << "baudgate: registers " << list.numbers << " of " << options.file
      << ": what does the list call the first holding register? No list says it, and a wrong guess "
         "reads the neighbours. Its manual has an example, or try one value with each:\n"
         "  --first-register 0      0, as on the wire\n"
         "  --first-register 1      1\n"
         "  --first-register 40001  40001; 30001 is the first input register, 10001 a discrete "
         "input, 1 a coil\n";
}

}  // namespace

int RunNewProfile(const NewProfileOptions& options, const config::Catalog& catalog,
                  std::ostream& out, std::ostream& err) {
  const auto text = ReadWhole(options.file);
  if (!text) {
    err << "baudgate: cannot read " << options.file << "\n";
    return kExitCanNot;
  }
  if (text->find('\0') != std::string::npos) {
    err << "baudgate: " << options.file << " is UTF-16 or no text; save it as CSV in UTF-8\n";
    return kExitBadConfiguration;
  }
  const Protocol* protocol = catalog.FindProtocol(kProtocol);
  if (protocol == nullptr) {
    err << "baudgate: protocol " << kProtocol << " is not installed\n";
    return kExitCanNot;
  }
  const RegisterList list =
      ReadRegisterList(AsUtf8(*text), options.file, options.table, options.first);
  for (const std::string& warning : list.warnings) err << warning << '\n';
  for (const std::string& error : list.errors) err << error << '\n';
  if (!list.numbers.empty() && !options.first) {
    AskForFirst(list, options, err);
    return kExitUsage;
  }
  if (!list.errors.empty()) return kExitBadConfiguration;
  const std::string profile = ProfileText(list, options);
  const std::string stem = std::filesystem::path(options.file).stem().string();
  const auto loaded =
      config::LoadProfileText(profile, options.file + " as a profile", stem, *protocol, catalog);
  PrintProblems(loaded.problems, err);
  if (!loaded.ok()) return kExitBadConfiguration;
  out << profile;
  const bool wide = std::ranges::any_of(list.points, [](const ListedPoint& point) {
    return RegistersOf(point.form) > 1 && !point.form.starts_with("string") && point.order.empty();
  });
  if (wide) {
    err << "note: values of several registers are read high word first; where the manual says "
           "CDAB, \"low word first\" or \"swapped\", add the line 'order: CDAB' to the profile, "
           "or a column 'order' to the list\n";
  }
  return kExitDone;
}

}  // namespace baudgate
