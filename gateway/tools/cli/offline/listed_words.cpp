// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/listed_words.h"

#include <algorithm>
#include <array>
#include <span>

#include "gateway/base/text.h"

namespace baudgate {

namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// What the line "sep=;" names, which Excel reads and other programs write for Excel; '\0': there
/// is no such line. Takes the line off the text, but not its end, so that lines count on.
char TakeNamedSeparator(std::string_view& text) {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  std::string_view line = text.substr(0, end);
  if (line.size() > 2 && line.starts_with('"') && line.ends_with('"')) {
    line = line.substr(1, line.size() - 2);
  }
  if (line.size() != 5 || config::Lower(line.substr(0, 4)) != "sep=") return '\0';
  text.remove_prefix(end);
  return line[4];
}

/// The separator of the first row that is not empty.
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

/// Letters and digits, in lower case.
std::string Bare(std::string_view text) {
  std::string bare;
  for (const char c : config::Lower(text)) {
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) bare += c;
  }
  return bare;
}

/// `words`: separated by blanks.
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

std::string InQuotes(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c == '\n' || c == '\t' ? ' ' : c;
  }
  return quoted + "\"";
}

}  // namespace baudgate
