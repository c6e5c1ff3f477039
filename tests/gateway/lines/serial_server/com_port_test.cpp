// Tests of RFC 2217, command by command: the calls to the port and the answers to the client.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/lines/serial_server/session.h"
#include "gateway/lines/serial_server/telnet.h"
#include "tests/gateway/lines/serial_server/fake_port.h"

namespace baudgate::serial_server {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::IsEmpty;

std::string Inner(const Bytes& answer) {
  const std::string text = ToHex(answer);
  constexpr std::size_t kAround = 9 + 6;
  return text.size() < kAround ? text : text.substr(9, text.size() - kAround);
}

struct Step {
  const char* what;
  const char* command;
  const char* answer;
  std::vector<std::string> calls;
};

class ComPortTest : public testing::Test {
 protected:
  ComPortTest() { com_.On(*ParseHex("0B FF")); }
  std::string On(const char* command) { return Inner(com_.On(*ParseHex(command))); }
  void Try(const Step& step) {
    port_.calls.clear();
    EXPECT_EQ(On(step.command), step.answer) << step.what;
    EXPECT_THAT(port_.calls, ElementsAreArray(step.calls)) << step.what;
  }

  test::FakePort port_;
  ComPort com_{port_, config::SerialSettings{}, "baudgate bay-1"};
};

TEST_F(ComPortTest, SetsTheRequestedSerialSettings) {
  const Step kSteps[] = {
      {"baud", "01 00 00 4B 00", "65 00 00 4B 00", {"apply 19200 8N1"}},
      {"baud, asked", "01 00 00 00 00", "65 00 00 4B 00", {}},
      {"baud, cut short", "01 00 00", "", {}},
      {"data bits", "02 07", "66 07", {"apply 19200 7N1"}},
      {"data bits, asked", "02 00", "66 07", {}},
      {"data bits, nonsense", "02 09", "66 07", {}},
      {"odd", "03 02", "67 02", {"apply 19200 7O1"}},
      {"even", "03 03", "67 03", {"apply 19200 7E1"}},
      {"mark", "03 04", "67 04", {"apply 19200 7M1"}},
      {"space", "03 05", "67 05", {"apply 19200 7S1"}},
      {"parity, nonsense", "03 06", "67 05", {}},
      {"no parity", "03 01", "67 01", {"apply 19200 7N1"}},
      {"two stop bits", "04 02", "68 02", {"apply 19200 7N2"}},
      {"1.5 stop bits with 7 data bits", "04 03", "68 02", {}},
      {"5 data bits", "02 05", "66 05", {"apply 19200 5N2"}},
      {"whose two stop bits are 1.5", "04 03", "68 03", {}},
      {"one stop bit", "04 01", "68 01", {"apply 19200 5N1"}},
  };
  for (const Step& step : kSteps) Try(step);
}

TEST_F(ComPortTest, SetsFlowControlAndLines) {
  const Step kSteps[] = {
      {"flow, asked", "05 00", "69 01", {}},
      {"XON/XOFF", "05 02", "69 02", {"apply 9600 8N1 xonxoff"}},
      {"inbound, asked", "05 0D", "69 0F", {}},
      {"RTS/CTS", "05 03", "69 03", {"apply 9600 8N1 rtscts"}},
      {"inbound none", "05 0E", "69 0E", {"apply 9600 8N1"}},
      {"DCD flow is not there", "05 11", "69 01", {}},
      {"break", "05 05", "69 05", {"break on"}},
      {"break, asked", "05 04", "69 05", {}},
      {"break off", "05 06", "69 06", {"break off"}},
      {"DTR, asked", "05 07", "69 08", {}},
      {"DTR off", "05 09", "69 09", {"dtr off"}},
      {"DTR on", "05 08", "69 08", {"dtr on"}},
      {"RTS off", "05 0C", "69 0C", {"rts off"}},
      {"RTS, asked", "05 0A", "69 0C", {}},
      {"nonsense", "05 63", "", {}},
  };
  for (const Step& step : kSteps) Try(step);
}

TEST_F(ComPortTest, AnswersTheOtherCommands) {
  const Step kSteps[] = {
      {"signature", "00", "64 62 61 75 64 67 61 74 65 20 62 61 79 2D 31", {}},
      {"the client's own", "00 61 62", "", {}},
      {"purge input", "0C 01", "70 01", {"purge input"}},
      {"purge output", "0C 02", "70 02", {"purge output"}},
      {"purge both", "0C 03", "70 03", {"purge input output"}},
      {"purge, nonsense", "0C 04", "", {}},
      {"mask of line states", "0A 1E", "6E 1E", {}},
      {"mask of modem states", "0B F0", "6F F0", {}},
      {"modem state", "07", "6B 00", {}},
      {"line state: all is sent", "06", "6A 60", {}},
      {"unknown", "4D 01", "", {}},
      {"nothing", "", "", {}},
  };
  for (const Step& step : kSteps) Try(step);
  EXPECT_FALSE(com_.suspended());
  On("08");
  EXPECT_TRUE(com_.suspended());
  On("09");
  EXPECT_FALSE(com_.suspended());
}

TEST_F(ComPortTest, ReportsTheOldSettingsWhenTheDriverRefusesNewOnes) {
  port_.refused = "115200";
  Try({"baud", "01 00 01 C2 00", "65 00 00 25 80", {"apply 115200 8N1", "apply 9600 8N1"}});
  port_.refused = "8E1";
  Try({"parity", "03 03", "67 01", {"apply 9600 8E1", "apply 9600 8N1"}});
  port_.no_switches = true;
  Try({"DTR", "05 09", "69 08", {}});
  Try({"break", "05 05", "69 06", {}});
}

TEST(ComPort, KeepsSoftwareParityWithAParityBit) {
  test::FakePort port;
  config::SerialSettings serial{
      .data_bits = 7, .parity = config::Parity::even, .software_parity = true};
  ComPort com(port, serial, "");
  com.On(*ParseHex("03 02"));
  com.On(*ParseHex("03 01"));
  EXPECT_THAT(port.calls, ElementsAre("apply 9600 7O1 software", "apply 9600 7N1"));
}

TEST(ComPort, ReportsTheModemStateWithTheFirstAnswer) {
  test::FakePort port;
  port.modem = ModemLines{.cts = true, .dcd = true};
  ComPort com(port, {}, "");
  EXPECT_EQ(ToHex(com.On(*ParseHex("02 00"))), "FF FA 2C 66 08 FF F0 FF FA 2C 6B 99 FF F0");
  EXPECT_EQ(ToHex(com.On(*ParseHex("02 00"))), "FF FA 2C 66 08 FF F0");
}

TEST(ComPort, ReportsOnlyChangesThatTheMasksAllow) {
  test::FakePort port;
  port.modem = ModemLines{.cts = true};
  ComPort com(port, {}, "");
  EXPECT_THAT(com.Poll(), IsEmpty());
  com.On(*ParseHex("0A 1F"));
  EXPECT_THAT(com.Poll(), IsEmpty());
  port.modem = ModemLines{.dsr = true};
  EXPECT_EQ(Inner(com.Poll()), "6B 23") << "DSR, and that CTS and DSR have changed";
  port.modem->ring = true;
  EXPECT_EQ(Inner(com.Poll()), "6B 60");
  port.modem->ring = false;
  EXPECT_EQ(Inner(com.Poll()), "6B 24") << "the bell has ended";
  com.On(*ParseHex("0B 80"));
  port.modem->cts = true;
  EXPECT_THAT(com.Poll(), IsEmpty()) << "only DCD is wanted";
  port.counters = {.parity = 1, .framing = 1, .overrun = 1, .breaks = 1};
  EXPECT_EQ(Inner(com.Poll()), "6A 1E");
  EXPECT_THAT(com.Poll(), IsEmpty());
}

/// Returns items such as "data 61 62", "FD 2C", "sub 2C 01 41". Data bytes that follow each other
/// are one item.
std::vector<std::string> Items(TelnetDecoder& decoder, const std::vector<Bytes>& pieces) {
  std::vector<std::string> items;
  bool data_last = false;
  for (const Bytes& piece : pieces) {
    View rest = piece;
    while (const auto item = decoder.Next(rest)) {
      const bool data = item->what == TelnetItem::What::data;
      if (data && data_last) {
        items.back() += " " + ToHex(item->bytes);
      } else if (data) {
        items.push_back("data " + ToHex(item->bytes));
      } else if (item->what == TelnetItem::What::negotiation) {
        items.push_back(ToHex(Bytes{item->verb, item->option}));
      } else if (item->what == TelnetItem::What::break_key) {
        items.emplace_back("break");
      } else {
        items.push_back("sub " + ToHex(Bytes{item->option}) +
                        (item->bytes.empty() ? "" : " " + ToHex(item->bytes)));
      }
      data_last = data;
    }
    EXPECT_TRUE(rest.empty());
  }
  return items;
}

struct Stream {
  const char* what;
  const char* bytes;
  std::vector<std::string> items;
  bool binary = true;
};

const Stream kStreams[] = {
    {"plain data", "61 62 0D 00 63", {"data 61 62 0D 00 63"}},
    {"a doubled IAC is one byte FF", "61 FF FF 62 FF FF FF FF", {"data 61 FF 62 FF FF"}},
    {"negotiations between data",
     "61 FF FD 2C FF FB 00 62",
     {"data 61", "FD 2C", "FB 00", "data 62"}},
    {"a subnegotiation with FF inside",
     "FF FA 2C 01 FF FF 03 FF F0 61",
     {"sub 2C 01 FF 03", "data 61"}},
    {"an empty subnegotiation", "FF FA 2C FF F0", {"sub 2C"}},
    {"the break key between data", "61 FF F3 62 FF FF F3", {"data 61", "break", "data 62 FF F3"}},
    {"commands for terminals say nothing", "61 FF F1 FF F9 62", {"data 61 62"}},
    {"a command breaks a subnegotiation off", "FF FA 2C 01 FF FD 00 61", {"FD 00", "data 61"}},
    {"another subnegotiation breaks it off", "FF FA 2C 01 FF FA 2C 02 FF F0", {"sub 2C 02"}},
    {"a terminal sends CR as CR NUL", "61 0D 00 0D 0A 00", {"data 61 0D 0D 0A 00"}, false},
    {"FF behind CR is no NUL", "0D FF FF 00", {"data 0D FF 00"}, false},
};

TEST(TelnetDecoder, AnyFragmentationGivesTheSameItems) {
  for (const Stream& stream : kStreams) {
    const Bytes bytes = *ParseHex(stream.bytes);
    for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
      TelnetDecoder decoder;
      if (stream.binary) decoder.SetBinary();
      const Bytes head(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(cut));
      const Bytes tail(bytes.begin() + static_cast<std::ptrdiff_t>(cut), bytes.end());
      EXPECT_THAT(Items(decoder, {head, tail}), ElementsAreArray(stream.items))
          << stream.what << ", cut at " << cut;
    }
  }
}

TEST(TelnetDecoder, ReadsByteByByte) {
  for (const Stream& stream : kStreams) {
    TelnetDecoder decoder;
    if (stream.binary) decoder.SetBinary();
    std::vector<Bytes> pieces;
    const Bytes bytes = *ParseHex(stream.bytes);
    for (const std::uint8_t byte : bytes) pieces.push_back({byte});
    EXPECT_THAT(Items(decoder, pieces), ElementsAreArray(stream.items)) << stream.what;
  }
}

TEST(TelnetDecoder, DropsAnEndlessSubnegotiation) {
  TelnetDecoder decoder;
  Bytes flood = {telnet::kIac, telnet::kSb, telnet::kComPort};
  flood.resize(flood.size() + TelnetDecoder::kLongest + 1, 0x55);
  Append(flood, View(Bytes{telnet::kIac, telnet::kSe, 0x61}));
  EXPECT_THAT(Items(decoder, {flood}), ElementsAre("data 61"));
}

TEST(TelnetOptions, OffersTheOptionsThatASerialPortNeeds) {
  EXPECT_EQ(ToHex(TelnetOptions().Begin()),
            "FF FB 00 FF FB 03 FF FB 01 FF FD 00 FF FD 03 FF FD 2C");
}

struct Dialogue {
  const char* what;
  std::vector<std::pair<const char*, const char*>> steps;  ///< verb and option, answer
};

const Dialogue kDialogues[] = {
    {"answers to offers are not answered", {{"FD 00", ""}, {"FB 2C", ""}, {"FE 01", ""}}},
    {"the client offers what we can do", {{"FD 2C", "FF FB 2C"}, {"FD 2C", ""}}},
    {"it takes it back", {{"FB 2C", ""}, {"FC 2C", "FF FE 2C"}, {"FC 2C", ""}}},
    {"unknown options are refused once",
     {{"FD 18", "FF FC 18"}, {"FD 18", ""}, {"FB 18", "FF FE 18"}}},
    {"that something unknown is off is no news", {{"FE 18", ""}, {"FC 18", ""}}},
};

TEST(TelnetOptions, AnswersOnlyOptionsThatChange) {
  for (const Dialogue& dialogue : kDialogues) {
    TelnetOptions options;
    options.Begin();
    for (const auto& [said, answer] : dialogue.steps) {
      const Bytes bytes = *ParseHex(said);
      EXPECT_EQ(ToHex(options.On(bytes[0], bytes[1])), answer) << dialogue.what << ": " << said;
    }
  }
}

TEST(TelnetOptions, AFloodIsAnsweredOnce) {
  TelnetOptions options;
  options.Begin();
  std::size_t answered = 0;
  for (int round = 0; round < 100; ++round) {
    for (int option = 45; option < 256; ++option) {
      answered += options.On(telnet::kDo, static_cast<std::uint8_t>(option)).size();
    }
  }
  EXPECT_EQ(answered, 3U * (256 - 45));
}

TEST(Telnet, DoublesTheCommandByteInData) {
  Bytes out;
  AppendEscaped(out, Bytes{0x61, 0xFF, 0xFF, 0x62});
  EXPECT_EQ(ToHex(out), "61 FF FF FF FF 62");
  EXPECT_EQ(ToHex(Subnegotiation(44, Bytes{101, 0xFF})), "FF FA 2C 65 FF FF FF F0");
}

}  // namespace
}  // namespace baudgate::serial_server
