// Tests of register lists as users type them, and the profiles made from them.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/register_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "gateway/tools/cli/offline/new_profile.h"

namespace baudgate::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

tools::RegisterList Read(const std::string& text, std::optional<tools::FirstRegister> first = {},
                         const std::string& table = "holding") {
  return ReadRegisterList(text, "l.csv", table, first);
}

std::string Row(const std::string& cells, tools::FirstRegister first,
                const std::string& header = "name,register,type") {
  const tools::RegisterList list = Read(header + "\n" + cells + "\n", first);
  if (!list.errors.empty()) return list.errors.front();
  const tools::ListedPoint& point = list.points.at(0);
  return point.table + " " + std::to_string(point.address) + " " + point.form + " " + point.type;
}

TEST(CsvTable, ReadsEverySeparatorQuoteAndLineEnd) {
  for (const char* text : {"a,b\n1,2\n", "a;b\r\n1;2\r\n", "a\tb\n1\t2",
                           "\xEF\xBB\xBF"
                           "a;b\n\n1;2\n",
                           "\"a\" , b\n 1,\"2\"\n"}) {
    const tools::CsvTable table = tools::ReadCsv(text);
    ASSERT_THAT(table.rows, SizeIs(2)) << text;
    EXPECT_THAT(table.rows[0].cells, ElementsAre("a", "b")) << text;
    EXPECT_THAT(table.rows[1].cells, ElementsAre("1", "2")) << text;
  }
  const tools::CsvTable quoted = tools::ReadCsv("a;b\n\"x;\"\"y\"\"\";0,1\nlast;row\n");
  EXPECT_THAT(quoted.rows[1].cells, ElementsAre("x;\"y\"", "0,1"));
  EXPECT_EQ(quoted.rows[2].line, 3);
  EXPECT_THAT(tools::ReadCsv("").rows, IsEmpty());
  for (const char* head : {"sep=;\r\n", "SEP=;\n", "\"sep=;\"\n"}) {
    const tools::CsvTable named = tools::ReadCsv(std::string(head) + "a,b;c\n1;2\n");
    ASSERT_THAT(named.rows, SizeIs(2)) << head;
    EXPECT_THAT(named.rows[0].cells, ElementsAre("a,b", "c")) << head;
    EXPECT_EQ(named.rows[1].line, 3) << "as the editor counts";
  }
  EXPECT_THAT(tools::ReadCsv("sep=\t\na,b\tc\n").rows.at(0).cells, ElementsAre("a,b", "c"));
}

TEST(RegisterList, TheFirstRegisterDeterminesTheAddresses) {
  EXPECT_EQ(Row("a,40001,UINT16", tools::FirstRegister::modicon), "holding 0 uint16 uint16");
  EXPECT_EQ(Row("a,30013,INT", tools::FirstRegister::modicon), "input 12 int16 int16");
  EXPECT_EQ(Row("a,10006,BOOL", tools::FirstRegister::modicon), "discrete 5 bool bool");
  EXPECT_EQ(Row("a,1,bit", tools::FirstRegister::modicon), "coil 0 bool bool");
  EXPECT_EQ(Row("a,00001,bit", tools::FirstRegister::modicon), "coil 0 bool bool");
  EXPECT_EQ(Row("a,465536,WORD", tools::FirstRegister::modicon), "holding 65535 uint16 uint16");
  EXPECT_EQ(Row("a,0,WORD", tools::FirstRegister::zero), "holding 0 uint16 uint16");
  EXPECT_EQ(Row("a,0x10,WORD", tools::FirstRegister::zero), "holding 16 uint16 uint16");
  EXPECT_EQ(Row("a,1,WORD", tools::FirstRegister::one), "holding 0 uint16 uint16");
  EXPECT_EQ(Row("a,input 12,REAL", tools::FirstRegister::one), "input 12 float32 float32");
  EXPECT_EQ(Row("a,7,WORD,FC4", tools::FirstRegister::zero, "name,register,type,function"),
            "input 7 uint16 uint16");
  EXPECT_EQ(Row("a,400001,WORD", tools::FirstRegister::modicon), "holding 0 uint16 uint16");
  EXPECT_THAT(Row("a,465537,WORD", tools::FirstRegister::modicon), HasSubstr("400001 to 465536"));
  for (const char* wrong : {"40000", "50001", "20001", "0", "465537"}) {
    EXPECT_THAT(Row(std::string("a,") + wrong + ",WORD", tools::FirstRegister::modicon),
                HasSubstr("l.csv:2: register '" + std::string(wrong) + "' is not valid"));
  }
  EXPECT_THAT(Row("a,0,WORD", tools::FirstRegister::one), HasSubstr("is not valid"));
  EXPECT_THAT(Row("a,65536,WORD", tools::FirstRegister::zero), HasSubstr("is not valid"));
}

TEST(RegisterList, RangesAcceptManyKindsOfDashes) {
  for (const char* range :
       {"40003-40004", "40003\u201340004", "40003 \u2013 40004", "40003\u201440004",
        "40003\u221240004", "40003\u202640004", "40003..40004", "40003~40004", "40003 to 40004",
        "40003-4", "40003\u201304"}) {
    EXPECT_EQ(Row(std::string("a,") + range + ",DINT", tools::FirstRegister::modicon),
              "holding 2 int32 int32")
        << range;
  }
  EXPECT_EQ(Row("a,0x10\u20130x11,REAL", tools::FirstRegister::zero), "holding 16 float32 float32");
  EXPECT_EQ(Row("a,input 12\u201313,REAL", tools::FirstRegister::zero), "input 12 float32 float32");
  EXPECT_THAT(Row("a,40004\u201340003,DINT", tools::FirstRegister::modicon),
              HasSubstr("is not valid"));
  EXPECT_THAT(Row("a,40003\u201340005,DINT", tools::FirstRegister::modicon), HasSubstr("are 3"));
}

TEST(RegisterList, ATextIsAsLongAsItsRegisters) {
  for (const char* type : {"STRING", "ascii", "Char", "text", "STRING(16)", "char 16"}) {
    EXPECT_EQ(Row(std::string("a,40001\u201340008,") + type, tools::FirstRegister::modicon),
              "holding 0 string(16) string(16)")
        << type;
  }
  EXPECT_THAT(Row("a,40001,STRING", tools::FirstRegister::modicon),
              AllOf(HasSubstr("has no length"), HasSubstr("40001-40008")));
  EXPECT_THAT(Row("a,40001-40004,STRING(16)", tools::FirstRegister::modicon), HasSubstr("are 4"));
}

TEST(RegisterList, AColumnMayGiveTheWordOrder) {
  const auto order = [](const std::string& type, const std::string& word,
                        const std::string& header = "Word order") {
    const tools::RegisterList list =
        Read("name;register;type;" + header + "\na;1;" + type + ";" + word + "\n",
             tools::FirstRegister::one);
    return list.errors.empty() ? list.points.at(0).order : list.errors.front();
  };
  for (const auto& [word, meant] : {std::pair{"CDAB", "CDAB"},
                                    {"low word first", "CDAB"},
                                    {"LSW first", "CDAB"},
                                    {"Word-swap", "CDAB"},
                                    {"big-endian", "ABCD"},
                                    {"ABCD", "ABCD"},
                                    {"byte swap", "BADC"},
                                    {"DCBA", "DCBA"},
                                    {"", ""},
                                    {"\u2013", ""}}) {
    EXPECT_EQ(order("REAL", word), meant) << word;
  }
  EXPECT_EQ(order("UDINT", "CDAB", "Endianness"), "CDAB");
  EXPECT_EQ(order("UINT", "CDAB"), "") << "one register has no words";
  EXPECT_EQ(order("STRING(8)", "CDAB"), "");
  EXPECT_EQ(order("UINT", "BADC"), "BADC");
  EXPECT_THAT(order("UINT", "DCBA"), HasSubstr("write BADC"));
  EXPECT_THAT(order("REAL", "little endian"), HasSubstr("is unknown or ambiguous"))
      << "nobody guesses";
}

TEST(RegisterList, ReportsRegisterNumbersThatNeedTheFirstRegister) {
  EXPECT_EQ(Read("name,register,type\na,40007,INT\nb,40003,INT\n").numbers, "40003…40007");
  EXPECT_EQ(Read("name,register,type\na,holding 3,INT\n").numbers, "");
}

TEST(RegisterList, ColumnsMayHaveAnyOrderAndManyNames) {
  const tools::RegisterList list = Read(
      "R/W;Data type;Factor;Units;Parameter;Modbus address;Colour\n"
      "RW;unsigned int 16;0,1;°C;Set point #1;40011;red\n",
      tools::FirstRegister::modicon);
  EXPECT_THAT(list.errors, IsEmpty());
  EXPECT_THAT(list.warnings, ElementsAre("l.csv:1: column 'Colour' is not used"));
  ASSERT_THAT(list.points, SizeIs(1));
  const tools::ListedPoint& point = list.points.front();
  EXPECT_EQ(point.name, "set_point_1");
  EXPECT_EQ(point.description, "Set point #1");
  EXPECT_EQ(point.unit, "°C");
  EXPECT_EQ(point.scale, *Decimal::Parse("0.1"));
  EXPECT_EQ(point.type, "float32");
  EXPECT_EQ(point.access, "rw");
  EXPECT_EQ(point.registers, 2U);
}

TEST(RegisterList, ScalesAndWideNumbersKeepTheirDigits) {
  const auto type = [](const std::string& cells) {
    return Row(cells, tools::FirstRegister::zero, "name,register,type,scale");
  };
  EXPECT_EQ(type("a,0,INT,1/10"), "holding 0 int16 float32");
  EXPECT_EQ(type("a,0,UDINT,0.01"), "holding 0 uint32 float64");
  EXPECT_EQ(type("a,0,UINT,10"), "holding 0 uint16 int64");
  EXPECT_EQ(type("a,0,UDINT,1"), "holding 0 uint32 uint32");
  EXPECT_EQ(type("a,0,bcd32,"), "holding 0 bcd32 uint32");
  EXPECT_THAT(type("a,0,INT,0"), HasSubstr("scale '0' is not a number"));
  EXPECT_THAT(type("a,0,INT,x10"), HasSubstr("for example 0.1 or 1/10"));
  EXPECT_THAT(type("a,0,STRING(8),2"), HasSubstr("only numbers"));
}

TEST(RegisterList, NumbersThatSuggestAnotherFirstRegisterAreWarnedAbout) {
  const auto warning = [](const std::string& number, tools::FirstRegister first) {
    const tools::RegisterList list = Read("name,register,type\na," + number + ",WORD\n", first);
    return list.warnings.empty() ? std::string() : list.warnings.front();
  };
  EXPECT_THAT(warning("40001", tools::FirstRegister::one),
              AllOf(HasSubstr("taken for address 40000"), HasSubstr("--first-register 40001")));
  EXPECT_THAT(warning("30005", tools::FirstRegister::zero), HasSubstr("taken for address 30005"));
  EXPECT_EQ(warning("40001", tools::FirstRegister::modicon), "");
  EXPECT_EQ(warning("40000", tools::FirstRegister::zero), "") << "as SunSpec counts";
}

TEST(RegisterList, SharedRegistersAreReported) {
  const tools::RegisterList list = Read(
      "name,register,type,table\n"
      "a,10,UDINT,\n"
      "b,11,INT,\n"
      "c,12,INT,\n"
      "d,12,UINT,\n"
      "e,11,INT,input\n"
      "f,20,STRING(8),\n"
      "g,23,INT,\n",
      tools::FirstRegister::zero);
  EXPECT_THAT(list.errors,
              ElementsAre(AllOf(HasSubstr("l.csv:3: 'b' (holding 11) overlaps 'a' in line 2"),
                                HasSubstr("(holding 10…11)")),
                          HasSubstr("l.csv:8: 'g' (holding 23) overlaps 'f'")));
  EXPECT_THAT(list.warnings,
              ElementsAre(HasSubstr("'d' (holding 12) reads the same register as 'c'")));
  EXPECT_THAT(Read("name,register,type\na,1,DINT\nb,1,INT\n").errors, IsEmpty())
      << "it is not known yet where they are";
}

TEST(RegisterList, ADecimalCommaInACommaSeparatedListIsReported) {
  const tools::RegisterList list = Read(
      "name,register,type,scale,unit\n"
      "a,1,INT,0,1,V\n"
      "b,2,INT,\"0,1\",V\n"
      "c,3,INT,0,1\n",
      tools::FirstRegister::one);
  EXPECT_THAT(list.errors,
              ElementsAre(AllOf(HasSubstr("l.csv:2: there are 6 cells, and 5 columns"),
                                HasSubstr("in quotes, \"0,1\"")),
                          AllOf(HasSubstr("l.csv:4: scale '0'"), HasSubstr("in quotes, \"0,1\""))));
  EXPECT_THAT(Read("name,register,type\na,1,INT,,\n", tools::FirstRegister::one).errors, IsEmpty());
}

TEST(RegisterList, ExamplesMustFitTheirType) {
  const auto shown = [](const std::string& type, const std::string& example,
                        const std::string& scale = "1") {
    const tools::RegisterList list =
        Read("name;register;type;scale;example\na;1;" + type + ";" + scale + ";" + example + "\n",
             tools::FirstRegister::one);
    if (!list.errors.empty()) return list.errors.front();
    return list.points.at(0).type + " " + list.points.at(0).simulate.value_or("-");
  };
  for (const auto& [type, example, scale, simulate] : {
           std::array<const char*, 4>{"UINT", "230,4", "0,1", "float32 2304"},
           {"UINT", "", "1", "uint16 -"},
           {"UINT", "0.5", "1E-05", "float32 50000"},
           {"REAL", "1,5e3", "1", "float32 1500"},
           {"STRING(8)", "Acme \"1\"", "1", "string(8) \"Acme \\\"1\\\"\""},
           {"DATE", "1970-01-02", "1", "DATE 86400"},
           {"DT", "1970-01-01 00:01:00", "1", "DT 60"},
           {"TOD", "00:00:01", "1", "TOD 1000"},
           {"TIME", "2s", "1", "TIME 2000"},
           {"TIME", "7", "1", "TIME 7"},
       }) {
    EXPECT_EQ(shown(type, example, scale), simulate) << type << " " << example;
  }
  EXPECT_THAT(shown("UINT", "70000"), HasSubstr("uint16 holds 0 to 65535"));
  EXPECT_THAT(shown("INT", "-4000", "0,1"), HasSubstr("is -40000 in the device"));
  EXPECT_THAT(shown("STRING(4)", "Acme1"), HasSubstr("is longer than string(4)"));
  EXPECT_THAT(shown("DATE", "27.11.2026"), HasSubstr("2026-11-27"));
  EXPECT_THAT(shown("UINT", "high"), HasSubstr("is not of type uint16; write for example 230.4"));
  EXPECT_THAT(shown("DATE", "5", "2"), HasSubstr("only numbers"));
}

TEST(RegisterList, AllErrorsAreReportedWithTheirLines) {
  const tools::RegisterList list = Read(
      "name,register,type,access,table\n"
      "a,40001,UNIT16,r,\n"
      "A,40002,INT,readable,\n"
      "b,40003-40004,INT,r,\n"
      ",40005,INT,r,\n"
      "c,30001,INT,rw,\n"
      "d,40009,INT,r,input\n"
      "e,10001,INT,r,\n"
      "g,,INT,r,\n",
      tools::FirstRegister::modicon);
  EXPECT_THAT(list.errors,
              ElementsAre(HasSubstr("l.csv:2: type 'UNIT16' is unknown; write bool"),
                          HasSubstr("l.csv:3: point 'a' occurs twice, first in line 2"),
                          HasSubstr("l.csv:3: access 'readable' is unknown; write r, w or rw"),
                          HasSubstr("l.csv:4: type int16 takes 1 register, and"),
                          HasSubstr("l.csv:5: no name"),
                          HasSubstr("l.csv:6: access: table input is read-only; write r"),
                          HasSubstr("l.csv:7: register '40009' is of table holding"),
                          HasSubstr("l.csv:8: type int16 does not fit table discrete"),
                          HasSubstr("l.csv:9: no register")));
  EXPECT_THAT(Read("title\nx\n").errors, SizeIs(3));
  EXPECT_THAT(Read("").errors, ElementsAre("l.csv is empty"));
  EXPECT_THAT(Read("name,register,type\n").errors, ElementsAre(HasSubstr("no row follows")));
  EXPECT_THAT(Read("name,tag,register,type\n").errors, ElementsAre(HasSubstr("occurs twice")));
}

TEST(ListedWords, CoverTheTypeNamesOfManyManuals) {
  for (const auto& [word, form] : {std::pair{"U16", "uint16"},
                                   {"unsigned-int16", "uint16"},
                                   {"S32", "int32"},
                                   {"Dint", "int32"},
                                   {"FLOAT", "float32"},
                                   {"IEEE 754", "float32"},
                                   {"LREAL", "float64"},
                                   {"USINT", "uint8"},
                                   {"String[12]", "string(12)"},
                                   {"Boolean", "bool"}}) {
    EXPECT_EQ(tools::FormNamed(word), form) << word;
  }
  EXPECT_FALSE(tools::FormNamed("int17"));
  EXPECT_EQ(tools::FormNamed("string"), "string") << "its registers say how long";
  EXPECT_FALSE(tools::FormNamed("string(0)"));
  EXPECT_FALSE(tools::FormNamed(""));
}

}  // namespace
}  // namespace baudgate::testing
