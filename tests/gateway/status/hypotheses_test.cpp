// Each cause that `baudgate status` knows: what supports it, what excludes it, and what is said.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/hypotheses.h"

#include <string>
#include <vector>

#include "tests/gateway/status/diagnose_fixture.h"

namespace baudgate::control {
namespace {

using enum Symptom;

struct Seen {
  Symptom symptom;
  std::uint32_t count;
  Finding finding{};
};

struct Row {
  std::vector<Seen> seen;
  std::string says;
  bool answered = false;  ///< the device has answered before
  bool healthy = false;   ///< a neighbour answers
  bool tcp = false;       ///< Modbus TCP
  std::string reason{};   ///< of the last failure
};

class HypothesesTest : public DiagnoseTest {
 protected:
  std::string SayOf(const Row& row) {
    config_.lines[0].port = row.tcp ? "tcp://10.0.0.7:502" : "/dev/ttyUSB0";
    config_.lines[0].serial = row.tcp
                                  ? config::SerialSettings{.baud = config::SerialSettings::kNoWire}
                                  : TwoLines().lines[0].serial;
    NeverAnswered();
    device().timing.reply = 100ms;
    device().timing.gap = 50ms;
    device().last_reason = row.reason;
    device().state = row.answered ? DeviceState::offline : DeviceState::never_seen;
    if (row.answered) device().last_ok = kNow.instant - 1min;
    for (const Seen& seen : row.seen) Looked(device(), seen.symptom, seen.count, seen.finding);
    device().exchanges = 30;
    neighbour_.status.findings = {};
    if (row.healthy) Looked(neighbour_.status, clean, 32);
    const DeviceRecord both[] = {neighbour_, record_};
    const Evidence evidence = Gather(line_, record_, both, kNow);
    std::string text;
    for (const Hypothesis* hypothesis : Judge(evidence)) {
      text += (text.empty() ? "" : " | ") + hypothesis->say(evidence);
    }
    return text;
  }
};

TEST_F(HypothesesTest, TheBestSupportedOneIsSaid) {
  const Row rows[] = {
      {{{silence, 20}},
       "not a byte came: check power, wiring (A and B swapped?), address, bit rate and parity "
       "(address 2, 9600 7E1)"},
      {{{silence, 20}},
       "not a byte came: check its power, its unit (2) and what is behind tcp://10.0.0.7:502",
       false,
       false,
       true},
      {{{noise, 12}, {damaged, 5}, {silence, 3}},
       "bytes come, and not one good frame: bit rate, parity or data bits are not those of the "
       "device, or it speaks another protocol (address 2, 9600 7E1, spabus)"},
      {{{noise, 12}, {damaged, 5}},
       "its replies cannot be read, and feeder-1 is understood: two devices have its address (2), "
       "or its bit rate or parity is another than the line's (9600 7E1)",
       false,
       true},
      {{{noise, 12}},
       "what comes is not Modbus TCP: is it at tcp://10.0.0.7:502? A serial server that passes "
       "Modbus RTU on needs protocol: modbus_rtu",
       false,
       false,
       true},
      {{{clean, 20}, {damaged, 6}},
       "its replies come damaged (checksum): noise, bad termination or a bus without ground",
       true,
       false,
       false,
       "checksum"},
      {{{late, 4, {.time = 380ms}}, {silence, 16}},
       "its replies come up to 380 ms after the request, and timing.reply is 100 ms: set timing: { "
       "reply: 500ms } at the device"},
      {{{split, 3, {.time = 80ms}}, {tail_lost, 8}, {noise, 4}},
       "its replies come in pieces, with pauses of up to 80 ms, and timing.gap is 50 ms: set "
       "timing: { gap: 150ms } at the device; a radio, a serial server or a slow adapter makes "
       "such "
       "pauses"},
      {{{head_lost, 9}},
       "the first byte of its replies is missing: the converter turns from sending to receiving "
       "too "
       "late, so use one with automatic direction, or raise the answer delay of the device"},
      {{{tail_lost, 9, {.bytes = 16}}},
       "its replies break off (16 bytes came last) and nothing follows: a serial server or "
       "converter "
       "with too small a buffer, or a bad wire; ask for less at once if only long replies fail"},
      {{{end_lost, 9}},
       "the last byte of its replies is missing: a converter, or the driver of the device, lets go "
       "of the bus too early; use a converter with automatic direction"},
      {{{bytes_lost, 9, {.bytes = 17, .expected = 18}}},
       "bytes are missing inside its replies (17 where 18 belong): a converter or serial server in "
       "between changes what passes; set it to raw (no XON/XOFF, no Telnet, no change of line "
       "ends), "
       "or use another one"},
      {{{bytes_added, 9, {.bytes = 19, .expected = 18}}},
       "its replies have bytes too many (19 where 18 belong): a converter or serial server in "
       "between "
       "changes what passes; set it to raw (no XON/XOFF, no Telnet, no change of line ends), or "
       "use "
       "another one; feeder-1 is read well",
       false,
       true},
      {{{bad_check, 9}},
       "its replies have the right form and length, and their check value is always wrong: it "
       "computes another one (address 2, 9600 7E1), or two devices with its address answer "
       "together"},
      {{{clean, 9, {.specials = 2}}, {damaged, 5, {.bytes = 8, .specials = 3}}},
       "replies fail that contain 0A, and no others: a converter or serial server in between "
       "changes "
       "such bytes; set it to raw (no XON/XOFF, no Telnet, no change of line ends)",
       true},
      {{{clean, 9, {.expected = 40}}, {silence, 5, {.expected = 80}}},
       "it does not answer requests for long replies (80 bytes and more), and answers those for up "
       "to 40: ask for less at once (block, max_items or the like at the device)",
       true},
      {{{late_echo, 3}, {clean, 9}},
       "the gateway's own requests come back late: a converter, a modem or a serial server in "
       "between echoes; switch its echo off",
       true},
      {{{other_reply, 9}},
       "two different replies come to one request: two devices have its address (2); unplug one",
       false,
       false,
       false,
       "two different replies came at once"},
      {{{eighth_bit, 9}},
       "its replies are right once their eighth bit is taken away: it sends 7 data bits with "
       "parity, and the port is open with 9600 7E1: set serial: to 7E1 or 7O1 with its bit rate"},
      {{{text, 9, {.cause = "'login: '"}}},
       "text comes in place of replies ('login: '): /dev/ttyUSB0 leads to a console, a modem, "
       "another "
       "service or the menu of a serial server, not to the bus; check the port"},
      {{{zeros, 9}},
       "nothing but 00 or FF comes: A and B are swapped, a driver holds the line, or bias "
       "resistors "
       "are missing (9600 7E1)"},
      {{{endless, 9}},
       "bytes come without an end: something on the line sends by itself, or a transmitter is "
       "stuck; unplug devices one by one"},
      {{{echo, 9}},
       "only the request itself comes back: the adapter or the line echoes (set echo: strip at the "
       "line), and the device is silent: check its power and its wire",
       true},
      {{{other_protocol, 9, {.cause = "messages of Modbus RTU come back", .remedy = "set it"}}},
       "messages of Modbus RTU come back: set it"},
      {{{other_setting, 9, {.cause = "its replies carry no checksum", .remedy = "set it"}}},
       "its replies carry no checksum: set it"},
      {{{other_device, 9, {.cause = "slave 7 answers", .remedy = "check it"}}},
       "slave 7 answers: check it (configured: 2)"},
      {{{other_master, 2, {.cause = "another master", .remedy = "take it away"}}, {damaged, 8}},
       "another master: take it away"},
      {{{late_other, 5, {.cause = "feeder-1"}}, {clean, 9}},
       "late replies of feeder-1 come in place of its own: what is said there mends both",
       true},
      {{{odd, 9, {.cause = "2 values came where 8 channels are configured"}}},
       "its replies do not fit their requests (2 values came where 8 channels are configured): "
       "does "
       "the profile fit the device, with its options?"},
      {{{odd, 9, {.cause = "function 03: exception 0B, the device behind …"}}},
       "function 03: exception 0B, the device behind …: the gateway in between works, and the "
       "device "
       "behind it does not answer: check its power, its wire and its address (2) there"},
      {{{silence, 9}},
       "the server has closed the connection: the server takes the connection and does not answer: "
       "is Modbus TCP behind this port, is another client connected, does it know unit 2?",
       false,
       false,
       true,
       "the server has closed the connection"},
      {{{silence, 6}, {zeros, 5}},
       "not a byte came: check its power, its address and its wire (address 2, 9600 7E1); the line "
       "is right, feeder-1 answers | nothing but 00 or FF comes: A and B are swapped, a driver "
       "holds "
       "the line, or bias resistors are missing (9600 7E1)",
       false,
       true},
      {{{clean, 32}}, ""},
  };
  for (const Row& row : rows) EXPECT_EQ(SayOf(row), row.says);
}

TEST_F(HypothesesTest, SettingsNameTheCheckValue) {
  EXPECT_EQ(Settings(record_), "address 2, 9600 7E1");
  config_.lines[0].devices[1].options.Set("checksum", true);
  EXPECT_EQ(Settings(record_), "address 2, 9600 7E1, checksum on");
  config_.lines[0].devices[1].options.Set("checksum", std::string("crc"));
  EXPECT_EQ(Settings(record_), "address 2, 9600 7E1, checksum crc");
}

}  // namespace
}  // namespace baudgate::control
