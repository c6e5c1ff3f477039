// RFC 2217, command by command: what the port is told, and what the client is answered.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/lines/serial_server/session.h"
#include "tests/gateway/lines/serial_server/fake_port.h"

namespace baudgate::serial_server {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::IsEmpty;

/// The values of one answer: what stands between "FF FA 2C" and "FF F0".
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
  ComPortTest() { com_.On(*ParseHex("0B FF")); }  // it is told the modem state once
  std::string On(const char* command) { return Inner(com_.On(*ParseHex(command))); }
  void Try(const Step& step) {
    port_.calls.clear();
    EXPECT_EQ(On(step.command), step.answer) << step.what;
    EXPECT_THAT(port_.calls, ElementsAreArray(step.calls)) << step.what;
  }

  test::FakePort port_;
  ComPort com_{port_, config::SerialSettings{}, "baudgate bay-1"};
};

TEST_F(ComPortTest, SetsWhatIsAskedFor) {
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

TEST_F(ComPortTest, AnswersTheRest) {
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

TEST_F(ComPortTest, SaysWhatTheDriverDoesWhereItRefuses) {
  port_.refused = "115200";
  Try({"baud", "01 00 01 C2 00", "65 00 00 25 80", {"apply 115200 8N1", "apply 9600 8N1"}});
  port_.refused = "8E1";
  Try({"parity", "03 03", "67 01", {"apply 9600 8E1", "apply 9600 8N1"}});
  port_.no_switches = true;
  Try({"DTR", "05 09", "69 08", {}});
  Try({"break", "05 05", "69 06", {}});
}

TEST(ComPort, KeepsSoftwareParityWhereItCan) {
  test::FakePort port;
  config::SerialSettings serial{
      .data_bits = 7, .parity = config::Parity::even, .software_parity = true};
  ComPort com(port, serial, "");
  com.On(*ParseHex("03 02"));
  com.On(*ParseHex("03 01"));
  EXPECT_THAT(port.calls, ElementsAre("apply 9600 7O1 software", "apply 9600 7N1"));
}

TEST(ComPort, TellsTheModemStateWithTheFirstAnswer) {
  test::FakePort port;
  port.modem = ModemLines{.cts = true, .dcd = true};
  ComPort com(port, {}, "");
  EXPECT_EQ(ToHex(com.On(*ParseHex("02 00"))), "FF FA 2C 66 08 FF F0 FF FA 2C 6B 99 FF F0");
  EXPECT_EQ(ToHex(com.On(*ParseHex("02 00"))), "FF FA 2C 66 08 FF F0");
}

TEST(ComPort, TellsChangesThatTheMasksLetThrough) {
  test::FakePort port;
  port.modem = ModemLines{.cts = true};
  ComPort com(port, {}, "");
  EXPECT_THAT(com.Poll(), IsEmpty());  // it has said nothing yet
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

}  // namespace
}  // namespace baudgate::serial_server
