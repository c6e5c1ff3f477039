// What a telnet client's bytes mean, however they are cut, and what is answered.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/telnet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/base/text.h"

namespace baudgate::serial_server {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::IsEmpty;

/// "data 61 62", "FD 2C", "sub 2C 01 41"; data that lie side by side are one.
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

TEST(TelnetDecoder, GivesTheSameItemsAtEveryCut) {
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

TEST(TelnetDecoder, DropsASubnegotiationThatHasNoEnd) {
  TelnetDecoder decoder;
  Bytes flood = {telnet::kIac, telnet::kSb, telnet::kComPort};
  flood.resize(flood.size() + TelnetDecoder::kLongest + 1, 0x55);
  Append(flood, View(Bytes{telnet::kIac, telnet::kSe, 0x61}));
  EXPECT_THAT(Items(decoder, {flood}), ElementsAre("data 61"));
}

TEST(TelnetOptions, OffersWhatASerialPortNeeds) {
  EXPECT_EQ(ToHex(TelnetOptions().Begin()),
            "FF FB 00 FF FB 03 FF FB 01 FF FD 00 FF FD 03 FF FD 2C");
}

struct Dialogue {
  const char* what;
  std::vector<std::pair<const char*, const char*>> steps;  ///< verb and option; the answer
};

const Dialogue kDialogues[] = {
    {"answers to offers are not answered", {{"FD 00", ""}, {"FB 2C", ""}, {"FE 01", ""}}},
    {"the client offers what we can do", {{"FD 2C", "FF FB 2C"}, {"FD 2C", ""}}},
    {"it takes it back", {{"FB 2C", ""}, {"FC 2C", "FF FE 2C"}, {"FC 2C", ""}}},
    {"unknown options are refused once",
     {{"FD 18", "FF FC 18"}, {"FD 18", ""}, {"FB 18", "FF FE 18"}}},
    {"that something unknown is off is no news", {{"FE 18", ""}, {"FC 18", ""}}},
};

TEST(TelnetOptions, AnswerWhatChanges) {
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

TEST(Telnet, DoublesTheByteThatIsACommand) {
  Bytes out;
  AppendEscaped(out, Bytes{0x61, 0xFF, 0xFF, 0x62});
  EXPECT_EQ(ToHex(out), "61 FF FF FF FF 62");
  EXPECT_EQ(ToHex(Subnegotiation(44, Bytes{101, 0xFF})), "FF FA 2C 65 FF FF FF F0");
}

}  // namespace
}  // namespace baudgate::serial_server
