// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/new_profile.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <span>

#include "config/loader.h"
#include "config/points.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/base/whole_file.h"
#include "gateway/tools/cli/offline/check.h"

namespace baudgate::tools {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Returns ';' for a first line "sep=;", which Excel reads; '\0': there is no such line. Removes
/// the text of the line but keeps its end, so that line numbers stay correct.
char TakeNamedSeparator(std::string_view& text) {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  std::string_view line = text.substr(0, end);
  if (line.size() > 2 && line.starts_with('"') && line.ends_with('"')) {
    line = line.substr(1, line.size() - 2);
  }
  if (line.size() != 5 || Lower(line.substr(0, 4)) != "sep=") return '\0';
  text.remove_prefix(end);
  return line[4];
}

char SeparatorOf(std::string_view text) {
  const auto begin = text.find_first_not_of("\r\n");
  if (begin == std::string_view::npos) return ',';
  const std::string_view head = text.substr(begin, text.find_first_of("\r\n", begin) - begin);
  char best = ',';
  for (const char candidate : {';', '\t'}) {
    if (std::ranges::count(head, candidate) > std::ranges::count(head, best)) best = candidate;
  }
  return best;
}

class Reader {
 public:
  explicit Reader(CsvTable& table) : table_(table) {}

  void Read(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      const char c = text[i];
      if (quoted_) {
        const bool escaped = c == '"' && i + 1 < text.size() && text[i + 1] == '"';
        if (c == '"' && !escaped) {
          quoted_ = false;
          continue;
        }
        if (escaped) ++i;
        if (c == '\n') ++line_;
        cell_ += c;
      } else if (c == '"' && Trim(cell_).empty()) {
        quoted_ = true;
        cell_.clear();
      } else if (c == table_.separator) {
        EndCell();
      } else if (c == '\n') {
        EndRow();
      } else if (c != '\r') {
        cell_ += c;
      }
    }
    EndRow();
  }

 private:
  void EndCell() {
    row_.cells.emplace_back(Trim(cell_));
    cell_.clear();
  }
  void EndRow() {
    EndCell();
    row_.line = began_;
    const bool empty = std::ranges::all_of(row_.cells, [](const auto& c) { return c.empty(); });
    if (!empty) table_.rows.push_back(std::move(row_));
    row_ = {};
    began_ = ++line_;
  }

  CsvTable& table_;
  CsvRow row_;
  std::string cell_;
  bool quoted_ = false;
  int line_ = 1;
  int began_ = 1;
};

}  // namespace

CsvTable ReadCsv(std::string_view text) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  CsvTable table;
  const char named = TakeNamedSeparator(text);
  table.separator = named != '\0' ? named : SeparatorOf(text);
  Reader(table).Read(text);
  return table;
}

namespace {

std::string Bare(std::string_view text) {
  std::string bare;
  for (const char c : Lower(text)) {
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) bare += c;
  }
  return bare;
}

/// `words` are the names that mean `is`, separated by blanks.
struct Meaning {
  std::string_view is;
  std::string_view words;
};

constexpr Meaning kForms[] = {
    {"bool", "bool boolean bit binary"},
    {"int8", "int8 s8 i8 sint int8s"},
    {"uint8", "uint8 u8 usint byte"},
    {"int16", "int16 s16 i16 int short signed16 sint16 signedint16 int16signed signed16bit int16s"},
    {"uint16",
     "uint16 u16 word uint ushort unsigned16 unsignedint16 uint16unsigned unsigned16bit int16u"},
    {"int32", "int32 s32 i32 dint long signed32 sint32 signedint32 signed32bit int32s"},
    {"uint32", "uint32 u32 dword udint ulong unsigned32 unsignedint32 unsigned32bit int32u"},
    {"int64", "int64 s64 i64 lint signed64 sint64 signedint64 int64s"},
    {"uint64", "uint64 u64 lword ulint unsigned64 unsignedint64 int64u"},
    {"float32", "float32 float real f32 single floatingpoint float32bit floatieee754 ieee754"},
    {"float64", "float64 double lreal f64 float64bit"},
    {"bcd16", "bcd16 bcd"},
    {"bcd32", "bcd32"},
    {"TIME", "time"},
    {"DATE", "date"},
    {"TOD", "tod timeofday"},
    {"DT", "dt datetime dateandtime timestamp unixtime"},
};

constexpr Meaning kTables[] = {
    {"coil", "coil coils 0x 1 01 fc1 fc01 digitaloutput"},
    {"discrete", "discrete discreteinput discreteinputs 1x 2 02 fc2 fc02 digitalinput"},
    {"holding", "holding holdingregister holdingregisters 4x 3 03 fc3 fc03"},
    {"input", "input inputregister inputregisters 3x 4 04 fc4 fc04"},
};

constexpr Meaning kAccesses[] = {
    {"r", "r ro read readonly"},
    {"w", "w wo write writeonly"},
    {"rw", "rw wr readwrite readandwrite"},
};

constexpr Meaning kOrders[] = {
    {"ABCD",
     "abcd 1234 big bigendian be highwordfirst highword high msw mswfirst hilo none normal"},
    {"CDAB",
     "cdab 3412 lowwordfirst lowword low lsw lswfirst lohi wordswap wordswapped wordsswapped "
     "swappedwords swapwords swapped bigendianwordswap littleendianbyteswap"},
    {"BADC",
     "badc 2143 byteswap byteswapped bytesswapped swappedbytes swapbytes bigendianbyteswap"},
    {"DCBA", "dcba 4321"},
    {"CDABGHEF", "cdabghef"},
};

constexpr std::string_view kTextWords = "string str ascii asciistring char chars text";

std::optional<std::string> Named(std::span<const Meaning> meanings, std::string_view text) {
  const std::string bare = Bare(text);
  for (const Meaning& meaning : meanings) {
    const auto words = Split(meaning.words, ' ');
    if (std::ranges::find(words, bare) != words.end()) return std::string(meaning.is);
  }
  return std::nullopt;
}

std::string InQuotes(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c == '\n' || c == '\t' ? ' ' : c;
  }
  return quoted + "\"";
}

}  // namespace

std::optional<ListColumn> ColumnNamed(std::string_view header) {
  static constexpr std::array<std::pair<ListColumn, std::string_view>, 11> kColumns = {{
      {ListColumn::name, "name tag parameter variable signal point"},
      {ListColumn::address, "register address reg addr registeraddress modbusaddress"},
      {ListColumn::type, "type datatype format"},
      {ListColumn::unit, "unit units engineeringunit"},
      {ListColumn::scale, "scale factor scaling scalefactor multiplier resolution"},
      {ListColumn::access, "access rw readwrite mode"},
      {ListColumn::table, "table function functioncode fc registertype"},
      {ListColumn::group, "group"},
      {ListColumn::description, "description comment remark meaning"},
      {ListColumn::example, "example simulate"},
      {ListColumn::order, "order wordorder byteorder endian endianness endianess wordswap swap"},
  }};
  const std::string bare = Bare(header);
  for (const auto& [column, names] : kColumns) {
    const auto words = Split(names, ' ');
    if (std::ranges::find(words, bare) != words.end()) return column;
  }
  return std::nullopt;
}

std::optional<std::string> FormNamed(std::string_view text) {
  const std::string bare = Bare(text);
  const std::size_t digits = std::min(bare.find_first_of("0123456789"), bare.size());
  const auto words = Split(kTextWords, ' ');
  if (std::ranges::find(words, bare.substr(0, digits)) == words.end()) return Named(kForms, text);
  if (digits == bare.size()) return "string";
  const auto length = ParseInteger<int>(bare.substr(digits));
  if (!length || *length <= 0) return std::nullopt;
  return "string(" + std::to_string(*length) + ")";
}

std::optional<std::string> TableNamed(std::string_view text) { return Named(kTables, text); }

std::optional<std::string> OrderNamed(std::string_view text) { return Named(kOrders, text); }

std::optional<std::string> AccessNamed(std::string_view text) { return Named(kAccesses, text); }

std::size_t RegistersOf(const std::string& form) {
  if (form.starts_with("string(")) return (LengthOf(form) + 1) / 2;
  if (form.ends_with("32") || IsTimeForm(form)) return 2;
  return form.ends_with("64") ? 4 : 1;
}

std::size_t LengthOf(const std::string& form) {
  return ParseInteger<std::size_t>(form.substr(7, form.size() - 8)).value_or(1);
}

bool IsTimeForm(std::string_view form) {
  return form == "TIME" || form == "DATE" || form == "TOD" || form == "DT";
}

namespace {

/// The largest exponent that ListedNumber accepts, as in "1E308": that of a 64-bit float.
constexpr int kMostPlaces = 308;

template <typename Unit>
Decimal CountOf(WallTime time) {
  return Decimal(std::chrono::floor<Unit>(time.time_since_epoch()).count());
}

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

/// Returns the range of the integers of this form; empty: the form is a float.
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
    return Error{"is not of type " + form + "; write for example " + std::string(Like(form))};
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

/// The protocol of the new profile. modbus_tcp and modbus_ascii use the profiles of modbus_rtu as
/// well.
constexpr const char* kProtocol = "modbus_rtu";

/// The characters of Windows-1252 from 0x80 to 0x9F: dashes, quotes and the euro.
constexpr std::string_view kOfWindows[] = {
    "\u20AC", "?",      "\u201A", "\u0192", "\u201E", "\u2026", "\u2020", "\u2021",
    "\u02C6", "\u2030", "\u0160", "\u2039", "\u0152", "?",      "\u017D", "?",
    "?",      "\u2018", "\u2019", "\u201C", "\u201D", "\u2022", "\u2013", "\u2014",
    "\u02DC", "\u2122", "\u0161", "\u203A", "\u0153", "?",      "\u017E", "\u0178"};

/// Converts text to UTF-8. Text that is not UTF-8 must be Windows-1252, as spreadsheets write it.
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

/// Assigns consecutive Modbus registers and bits, which clients of the gateway read, to the points.
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

/// Returns how many digits the value has after its decimal point, because its scale has them; 0:
/// none, or not known, as for a float.
int DigitsOf(const ListedPoint& point) {
  constexpr int kMost = 9;
  if (point.form.starts_with("float")) return 0;
  for (int digits = 0; digits <= kMost; ++digits) {
    if (point.scale.Shifted(digits).is_whole()) return digits;
  }
  return 0;
}

std::string PointLine(const ListedPoint& point, std::size_t modbus) {
  std::string read = point.table + " " + std::to_string(point.address);
  if (point.form != "bool" && point.form != point.type) read += " " + point.form;
  if (!point.order.empty()) read += " " + point.order;
  std::string line = "  - { name: " + point.name + ", read: " + InQuotes(read);
  line += ", type: " + point.type;
  if (point.scale != 1) line += ", scale: " + point.scale.ToText();
  if (const int digits = DigitsOf(point); digits > 0) {
    line += ", precision: " + std::to_string(digits);
  }
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
      << ": it is unknown how the list numbers the first holding register, and a wrong number "
         "reads other registers. Add the option that fits the example in the manual or a known "
         "value:\n"
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
  const protocols::Protocol* protocol = catalog.FindProtocol(kProtocol);
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
    err << "note: values of several registers are read high word first. If the manual says CDAB, "
           "\"low word first\" or \"swapped\", add the line 'order: CDAB' to the profile, or a "
           "column 'order' to the list\n";
  }
  return kExitDone;
}

}  // namespace baudgate::tools
