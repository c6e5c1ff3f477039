// Each cause that `baudgate status` knows: what supports it, what excludes it, and what is said.
// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <iterator>
#include <string>

#include "protocols/set4tm/protocol.h"
#include "tests/gateway/outputs/status/hypotheses_fixture.h"

namespace baudgate::control {
namespace {

TEST_F(HypothesesTest, FewerRegistersThanAreAskedFor) {
  const Finding few = {
      .bytes = 25, .expected = 85, .cause = "22 bytes came where 82 answer the request"};
  const struct {
    const Protocol& protocol;
    std::size_t good;
    std::string block;
  } rows[] = {{ModbusRtuProtocol(), 21, "8"},
              {ModbusTcpProtocol(), 25, "8"},
              {ModbusAsciiProtocol(), 43, "8"},
              {ModbusRtuProtocol(), 0, "1"}};
  for (const auto& row : rows) {
    config_.lines[0].devices[1].traits = &row.protocol.traits;
    std::vector<Seen> seen = {{odd, 9, few}};
    if (row.good > 0) seen.push_back({clean, 2, {.bytes = row.good, .expected = row.good}});
    EXPECT_EQ(SayOf({.seen = seen, .says = {}, .state = kHere}),
              "it gives fewer registers than are asked for (22 bytes came where 82 answer the "
              "request): set block: " +
                  row.block + " in the configuration");
  }
}

/// A request that is never answered may contain such a byte by chance.
TEST_F(HypothesesTest, RequestsThatAConverterTakesForFlowControl) {
  constexpr std::uint8_t kXon = 0b00100;
  const QueryCount good = {.first_point = 0, .points = 1};
  const QueryCount dead = {
      .first_point = 1, .points = 1, .in_vain = 8, .symptom = silence, .asked = kXon};
  QueryCount other = dead;
  other.asked = 0;
  QueryCount cut = other;  // the reply has such a byte
  cut.symptom = tail_lost;
  const std::string says =
      "requests fail that contain 11, and no others: switch XON/XOFF off at the converter or "
      "serial server";
  const Seen silent = {silence, 16};
  EXPECT_EQ(SayOf({{{clean, 16}, silent}, {}, kAnswered | kHere, {good, dead, dead}}), says);
  EXPECT_THAT(Say(), ::testing::ElementsAre(says));
  EXPECT_EQ(SayOf({{{clean, 16}, silent}, {}, kAnswered | kHere, {good, dead, dead, cut}}), says);
  const struct {
    std::vector<Seen> seen;
    std::vector<QueryCount> queries;
  } others[] = {{{{clean, 16}, silent}, {good, dead}},
                {{{clean, 16}, silent}, {good, dead, dead, other}},
                {{{clean, 16, {.asked = kXon}}, silent}, {good, dead, dead}}};
  for (const auto& row : others) {
    EXPECT_NE(SayOf({row.seen, {}, kAnswered | kHere, row.queries}), says);
  }
}

/// Noise on the line looks otherwise each time.
TEST_F(HypothesesTest, NeighboursThatAreDamagedInManyWays) {
  const auto mixed = [this](DeviceStatus& status) {
    Looked(status, clean, 25);
    for (const Symptom symptom : {damaged, noise, end_lost, bad_check}) Looked(status, symptom, 1);
  };
  const std::string own = "a bad wire or plug at its end";
  mixed(device());
  Looked(device(), damaged, 2);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr(own));
  mixed(neighbour_.status);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("noise on the line: check termination"));
  Looked(neighbour_.status, clean, 32);
  Looked(neighbour_.status, silence, 4);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr(own)) << "something else is wrong with it";
}

TEST_F(HypothesesTest, ANeighbourThatNeverAnswersMayHaveItsAddress) {
  Looked(device(), damaged, 12);
  neighbour_.status.last_ok.reset();
  neighbour_.status.state = DeviceState::never_seen;
  Looked(neighbour_.status, silence, 32);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("its replies come damaged: feeder-1, which never "
                                             "answers, may have its address (2) as well"));
}

/// Each exchange hears a part of it.
TEST_F(HypothesesTest, SomethingSendsAllTheTime) {
  device().state = DeviceState::offline;
  device().last_ok = kNow.instant - 30s;
  Looked(device(), noise, 20);
  line_.babble = 3000;  // at 9600 bit/s
  line_.babble_since = kNow.instant - 30s;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("bytes come without an end"));
  line_.babble_since = kNow.instant - 10min;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("its replies come damaged"));
}

/// It asks for the same as the gateway now and then.
TEST_F(HypothesesTest, AnotherMasterThatWasHeardBesideANeighbour) {
  Looked(device(), late_echo, 5);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("the gateway's own requests come back late"));
  Looked(neighbour_.status, master_beside, 2, {.cause = "another master", .remedy = "one"});
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("another master: one"));
}

/// Meters that answer at once damage each other.
TEST_F(HypothesesTest, AllDevicesAnswerToACommonAddress) {
  config_.lines[0].devices[1].traits = &Set4tmProtocol().traits;
  Looked(device(), tail_lost, 12, {.bytes = 8, .expected = 16});
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("its replies break off"));
  config_.lines[0].devices[1].address = "0";
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("its replies break off"));
  device().doubled = 1;
  EXPECT_THAT(Say()[0],
              ::testing::HasSubstr("every device answers to address 0: give each its own"));
}

TEST_F(HypothesesTest, TheBestSupportedOneIsSaid) {
  const Row rows[] = {
      {{{silence, 20}},
       "not a byte came: check its power and wiring (A and B swapped?), then address (2), bit "
       "rate, parity and protocol (9600 7E1, spabus)"},
      {{{silence, 20}},
       "not a byte came: the server at tcp://10.0.0.7:502 accepts connections and does not answer: "
       "is unit 2 right (try 255)? Else restart it",
       kServer},
      {{{noise, 12}, {damaged, 5}, {silence, 3}},
       "bytes come, and not one good frame: a setting differs: bit rate, parity and protocol (9600 "
       "7E1, spabus): 'baudgate scan' finds it; or A and B are swapped"},
      {{{noise, 12}, {damaged, 5}},
       "its replies cannot be read: a setting differs: bit rate, parity and protocol (9600 7E1, "
       "spabus); or two devices have its address (2)",
       kNeighbour},
      {{{noise, 12}},
       "what comes is not Modbus TCP: check the port (tcp://10.0.0.7:502); a plain serial server "
       "needs protocol: modbus_rtu",
       kServer},
      {{{clean, 20}, {damaged, 6}},
       "its replies come damaged: noise on the line (check termination, ground and shield), or two "
       "devices have its address (2; unplug one)",
       kAnswered},
      {{{clean, 20}, {damaged, 6}, {other_master, 1}},
       "its replies come damaged: noise on the line (check termination, ground and shield), or two "
       "devices have its address (2; unplug one)",
       kAnswered},
      {{{late, 4, {.time = 380ms}}, {silence, 16}},
       "its replies come up to 380 ms after the request, and timing.reply is 100 ms: set timing: { "
       "reply: 500ms } in the configuration"},
      {{{late, 1, {.time = 380ms}}, {silence, 20}},
       "not a byte came: check its power and wiring (A and B swapped?), then address (2), bit "
       "rate, parity and protocol (9600 7E1, spabus)"},
      {{{clean, 9}, {damaged, 9}, {split, 2, {.time = 80ms}}},
       "its replies come damaged: noise on the line (check termination, ground and shield), or two "
       "devices have its address (2; unplug one)",
       kAnswered | kHere},
      {{{clean, 14}, {silence, 5}, {text, 1, {.cause = "'U-Boot 2013.04'"}}, {clean, 9}},
       "it restarts: text ('U-Boot 2013.04') comes after silence: look at its power supply and its "
       "firmware (watchdog)",
       kAnswered | kHere},
      {{{split, 3, {.time = 80ms}}, {tail_lost, 8}, {noise, 4}},
       "its replies come in pieces, with pauses of up to 80 ms, and timing.gap is 50 ms: set "
       "timing: { gap: 150ms } in the configuration"},
      {{{head_lost, 9}},
       "the first byte of its replies is missing: a converter switches too late: use "
       "automatic direction, or raise the device's answer delay"},
      {{{head_lost, 9, {.cause = "a few"}}},
       "the first bytes of its replies are missing: a converter switches too late: use "
       "automatic direction, or raise the device's answer delay"},
      {{{tail_lost, 9, {.bytes = 16}}},
       "its replies break off (16 bytes came): a driver lets go of the bus too early, or the "
       "buffer of a converter is too small"},
      {{{tail_lost, 9, {.cause = "its check value", .remedy = "update it"}}},
       "its replies carry no check value: update it"},
      {{{clean, 9}, {tail_lost, 9, {.cause = "its check value", .remedy = "update it"}}},
       "its replies break off before their check value: a driver lets go of the bus too early; use "
       "a converter with automatic direction",
       kAnswered | kHere},
      {{{one_behind, 9, {.cause = "slave 3 answers", .remedy = "check it"}}},
       "slave 3 answers: check it (configured: 2)",
       kNeighbour},
      {{{clean, 4, {.idle = 50ms}},
        {silence, 2, {.idle = 900ms}},
        {clean, 4, {.idle = 400ms}},
        {silence, 2, {.idle = 950ms}}},
       "requests get no answer behind a rest of 0.9 s, and their repeats do: it or its radio "
       "sleeps: shorten its poll, or switch sleep off",
       kAnswered | kHere},
      {{{end_lost, 9}},
       "the last byte of its replies is missing: a driver lets go of the bus too early; use a "
       "converter with automatic direction"},
      {{{bytes_lost, 9, {.bytes = 17, .expected = 18}}},
       "bytes are missing inside its replies: a converter takes them out (set it to raw) or is "
       "overrun (replace it)"},
      {{{end_lost, 9, {.cause = "garbled"}}},
       "the last byte of its replies comes garbled: it computes another check value, or a driver "
       "lets go of the bus too early (use a converter with automatic direction)"},
      {{{head_lost, 9, {.cause = "a few"}}, {noise, 9}},
       "the first bytes of its replies are missing: a converter switches too late: use "
       "automatic direction, or raise the device's answer delay"},
      {{{clean, 5}, {head_lost, 4}, {noise, 6}, {damaged, 1}},
       "the first bytes of its replies are missing: a converter switches too late: use "
       "automatic direction, or raise the device's answer delay",
       kAnswered | kHere},
      {{{tail_lost, 20, {.cause = "its check value", .remedy = "update it"}}, {bytes_lost, 8}},
       "bytes are missing inside its replies: a converter takes them out (set it to raw) or is "
       "overrun (replace it)"},
      {{{head_lost, 9, {.cause = "garbled"}}},
       "the first byte of its replies comes garbled: a converter switches too late: use "
       "automatic direction, or raise the device's answer delay"},
      {{{late, 3}, {silence, 3}, {one_behind, 2, {.cause = "lags"}}},
       "its replies answer the request before: restart the serial server or radio in between, and "
       "switch its cache off"},
      {{{bytes_added, 9, {.bytes = 19, .expected = 18}}},
       "its replies have bytes too many (19, not 18): two devices have its address and answer at "
       "once; or set the converter or serial server to raw (no XON/XOFF, no Telnet)",
       kNeighbour},
      {{{eighth_bit, Findings::kKept}},
       "right once the eighth bit is taken away: it sends 7 data bits with parity; the adapter "
       "does not do 9600 7E1: use another, or 7O1",
       kAnswered},
      {{{noise, Findings::kKept}},
       "bytes come, and not one good frame any more: its bit rate or parity was changed (9600 7E1 "
       "here): set both alike; or A and B are swapped",
       kAnswered},
      {{{bad_check, 9}},
       "its replies have a wrong check value: two devices have its address, or it computes another "
       "one"},
      {{{bad_check, 9}},
       "its replies have a wrong check value: it computes another one (see its manual and "
       "options), or two devices have its address",
       kNeighbour},
      {{{bad_check, 9, {.cause = "a text"}}},
       "its replies have a wrong check value: two devices have its address, it computes another "
       "one, or a converter loses bytes (use raw)"},
      {{{bad_check, 9, {.bytes = 7, .specials = 0x10 | kHighBit | kEvenByte}}},
       "only characters of one parity come, and FF in place of the others: its parity is another "
       "one; set both alike (9600 7E1)"},
      {{{text, 5, {.cause = "'IKZz;h'"}}, {noise, 5}},
       "bytes come, and not one good frame: a setting differs: bit rate, parity and protocol (9600 "
       "7E1, spabus): 'baudgate scan' finds it; or A and B are swapped"},
      {{{clean, 1, {.idle = kLongIdle}}, {silence, 20, {.idle = 90ms}}},
       "requests get no answer that come soon (90 ms) behind a telegram: try timing: { quiet: "
       "250ms } in the configuration, then more",
       kAnswered | kNeighbour},
      {{{clean, 1, {.idle = kLongIdle}}, {silence, 20, {.idle = 900ms}}},
       "not a byte comes any more: check its power and its wire, or whether its settings were "
       "changed",
       kAnswered | kNeighbour},
      {{{clean, 9, {.specials = 2}}, {damaged, 5, {.bytes = 8, .specials = 3}}},
       "replies fail that contain 0A, and no others: set the converter or serial server to raw (no "
       "XON/XOFF, no Telnet)",
       kAnswered},
      {{{clean, 9, {.expected = 40}},
        {silence, 3, {.expected = 80}},
        {clean, 2, {.expected = 40}},
        {silence, 3, {.expected = 80}}},
       "it does not answer requests for long replies (80 bytes; up to 40 are fine): ask for less "
       "at once (block, max_items)",
       kAnswered | kHere},
      {{{clean, 9, {.expected = 40}},
        {damaged, 3, {.expected = 80}},
        {clean, 2, {.expected = 40}},
        {damaged, 3, {.expected = 80}}},
       "long replies come damaged (80 bytes; up to 40 are fine): ask for less at once (block, "
       "max_items): a buffer is small",
       kAnswered | kHere},
      {{{clean, 4, {.idle = 600ms}},
        {silence, 2, {.idle = 20ms}},
        {clean, 4, {.idle = 600ms}},
        {silence, 2, {.idle = 90ms}}},
       "requests get no answer that come soon (90 ms) behind a telegram: try timing: { quiet: "
       "250ms } in the configuration, then more (650ms is enough)",
       kAnswered | kHere},
      {{{clean, 4, {.idle = 190ms}},
        {silence, 2, {.idle = 20ms}},
        {clean, 4, {.idle = 190ms}},
        {silence, 2, {.idle = 90ms}}},
       "requests get no answer that come soon (90 ms) behind a telegram: set timing: { quiet: "
       "200ms } in the configuration",
       kAnswered | kHere},
      {{{clean, 4, {.idle = 600ms}},
        {silence, 2, {.idle = 20ms}},
        {clean, 4, {.idle = 600ms}},
        {silence, 2, {.idle = 301ms}}},
       "requests get no answer that come soon (301 ms) behind a telegram: it loses every other "
       "one, or needs timing: { quiet: 650ms } in the configuration",
       kAnswered | kHere},
      {{{clean, 4, {.idle = 50ms}},
        {silence, 2, {.idle = 20ms}},
        {clean, 4, {.idle = 600ms}},
        {silence, 2, {.idle = 90ms}}},
       "single requests get no answer: noise, a bad wire or plug; or another program reads the "
       "port (fuser -v /dev/ttyUSB0)",
       kAnswered | kHere},
      {{{clean, 4}, {same_again, 3}, {one_behind, 2}},
       "the same reply comes whatever is asked: restart the device, or a radio or gateway in "
       "between (switch its cache off)",
       kAnswered},
      {{{clean, 4}, {same_again, 3, {.cause = "'LOC'"}}},
       "the same reply comes whatever is asked ('LOC'): end its local or other mode, or restart it",
       kAnswered},
      {{{one_behind, 2}, {clean, 1}, {one_behind, 2}, {clean, 1}, {one_behind, 2}},
       "its replies answer the request before: restart the serial server or radio in between, and "
       "switch its cache off",
       kAnswered},
      {{{late_echo, 3}, {clean, 9}},
       "the gateway's own requests come back late: a converter, modem or serial server in between "
       "echoes; switch its echo off",
       kAnswered},
      {{{eighth_bit, 9}},
       "right once the eighth bit is taken away: it sends 7 data bits with parity; the adapter "
       "does not do 9600 7E1: use another, or 7O1"},
      {{{text, 9, {.cause = "'login: '"}}},
       "text comes in place of replies ('login: '): a modem, console or menu: disconnect it, or "
       "check the port"},
      {{{clean, 9},
        {other_form, 9, {.cause = "its reply to weight is not as described", .remedy = "x"}}},
       "its reply to weight is not as described: x",
       kAnswered | kHere},
      {{{clean, 9}, {damaged, 6}, {other_form, 3, {.cause = "its reply is other", .remedy = "x"}}},
       "its replies come damaged: noise on the line (check termination, ground and shield), or two "
       "devices have its address (2; unplug one)",
       kAnswered | kHere},
      {{{eighth_bit, 9, {.cause = "mark"}}},
       "the eighth bit of its characters is always 1: 7 data bits with mark parity, or two stop "
       "bits; set 7M1 or 7N2 at the port of the serial server",
       kServer},
      {{{zeros, 9}},
       "nothing but 00 or FF comes: check the parity and the bit rate (9600 7E1), then A and B, "
       "the bias resistors and who drives the line"},
      {{{endless, 9}},
       "bytes come without an end: something on the line sends by itself, or a transmitter is "
       "stuck; unplug devices one by one"},
      {{{echo, 9}},
       "only the request itself comes back: set echo: strip in the configuration, then check "
       "power, wire "
       "and address (2) of the device",
       kAnswered},
      {{{echo, 9}},
       "only the request itself comes back: another service than Modbus TCP is there; check "
       "address and port",
       kServer},
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
       kAnswered},
      {{{odd, 9, {.cause = "2 values came where 8 channels are configured"}}},
       "its replies do not fit (2 values came where 8 channels are configured): does the profile "
       "fit the device and its options?"},
      {{{odd, 9, {.cause = "exception 0B; it is silent", .remedy = "check it there"}}},
       "exception 0B: check it there"},
      {{{silence, 9, {.ended = true}}},
       "the server closes the connection behind the request: is Modbus TCP behind this port, does "
       "it know unit 2?",
       kServer},
      {{{silence, 6}, {zeros, 5}},
       "not a byte came: check its power and wire, then its address (2), bit rate, parity and "
       "protocol (9600 7E1, spabus) | nothing but 00 or FF comes: check the parity and the bit "
       "rate (9600 7E1), then A and B, the bias resistors and who drives the line",
       kNeighbour},
      {{{two_replies, 6}, {damaged, 3}},
       "two different replies come to one request: two devices have its address (2; unplug one), "
       "or another master asks it (take it away)"},
      {{{clean, 14}, {silence, 5}, {text, 1, {.cause = "'34/3/1/2/0/0'"}}, {clean, 9}},
       "it was away for about 5.5 s: look for restarts, its power and a loose wire",
       kAnswered | kHere},
      {{{clean, 14}, {silence, 5}, {clean, 9}},
       "it was away for about 5.0 s: look at the server (power, restarts, dead connections) and "
       "the network (NAT)",
       kAnswered | kHere | kServer},
      {{{clean, 6}, {silence, 3}, {clean, 6}, {silence, 4}, {clean, 6}, {silence, 4}, {clean, 6}},
       "it is away for about 3.7 s every 9.5 s: look for restarts, its power and a loose wire",
       kAnswered | kHere},
      {{{silence, 2},
        {clean, 1},
        {silence, 2},
        {clean, 1},
        {silence, 2},
        {clean, 1},
        {silence, 2},
        {clean, 1},
        {silence, 2},
        {clean, 1},
        {silence, 2},
        {clean, 1},
        {silence, 2},
        {clean, 1}},
       "single requests get no answer: noise, a bad wire or plug at its end",
       kAnswered | kNeighbour | kHere},
      {{{zeros, 9, {.bytes = 14}}},
       "nothing but 00 or FF comes (14 bytes): each character has a wrong parity; set it alike "
       "(9600 7E1), or look for A and B swapped"},
      {{{text, 9, {.cause = "'S S 1.0 g'", .remedy = "switch it off"}}},
       "text comes in place of replies ('S S 1.0 g'): switch it off"},
      {{{tail_lost, 9, {.bytes = 4, .expected = 7}}},
       "its replies break off (4 of 7 bytes came): a driver lets go of the bus too early, or the "
       "buffer of a converter is too small"},
      {{{tail_lost, 9, {.bytes = 8, .cause = "its line end"}}},
       "its replies break off before their line end, the last byte or two: a converter takes it "
       "out (set it to raw), or a driver lets go of the bus too early"},
      {{{clean, 2, {.expected = 4}},
        {damaged, 5, {.bytes = 14, .specials = kEvenByte | kOddByte}},
        {clean, 2, {.expected = 4}},
        {damaged, 5, {.bytes = 14, .specials = kEvenByte | kOddByte}}},
       "no character of its replies has its eighth bit: the port or a converter in between has 7 "
       "data bits; set 8 (now 9600 7E1)",
       kAnswered | kHere},
      {{{clean, 9},
        {other_setting, 4, {.cause = "bytes 11 are missing inside its replies", .remedy = "raw"}},
        {damaged, 7, {.bytes = 8}}},
       "bytes 11 are missing inside its replies: raw",
       kAnswered | kHere},
      {{{clean, 9},
        {other_setting, 2, {.cause = "bytes 11 are missing inside its replies", .remedy = "raw"}},
        {damaged, 9, {.bytes = 8}}},
       "its replies come damaged: noise on the line (check termination, ground and shield), or two "
       "devices have its address (2; unplug one)",
       kAnswered | kHere},
      {{{clean, 9}, {end_lost, 9, {.cause = "garbled"}}},
       "the last byte of its replies comes garbled: a driver lets go of the bus too early (use one "
       "with automatic direction), or its replies come damaged: noise, a bad wire",
       kAnswered | kHere},
      {{{clean, 9}, {end_lost, 5, {.cause = "garbled"}}, {damaged, 4}},
       "its replies come damaged: noise on the line (check termination, ground and shield), or two "
       "devices have its address (2; unplug one)",
       kAnswered | kHere},
      {{{late, 1, {.time = 1200ms}},
        {other_reply, 9, {.cause = "its replies carry another number", .remedy = "update it"}}},
       "its replies carry another number: update it"},
      {{{clean, 20}, {bytes_lost, 1}, {head_lost, 3}, {bad_check, 4}},
       "bytes are missing inside its replies: a converter takes them out (set it to raw) or is "
       "overrun (replace it)",
       kAnswered | kHere},
      {{{clean, 20}, {bytes_lost, 1}, {head_lost, 3}, {bad_check, 4}, {damaged, 1}},
       "its replies come damaged: noise on the line (check termination, ground and shield), or two "
       "devices have its address (2; unplug one)",
       kAnswered | kHere},
      {{{tail_lost, 9, {.bytes = 5, .expected = 8}}},
       "its replies break off (5 of 8 bytes came): its driver lets go of the bus too early, or two "
       "devices have its address (2; unplug one)",
       kNeighbour},
      {{{silence, 9},
        {other_setting, 3, {.cause = "its replies end in a CRC", .remedy = "set it"}}},
       "its replies end in a CRC: set it"},
      {{{clean, 32}}, ""},
  };
  for (const Row& row : rows) EXPECT_EQ(SayOf(row), row.says);
}

/// A cause that one look sees most of the time is not replaced by the few failures of the next.
TEST_F(HypothesesTest, TheCauseDoesNotChangeWithEachLook) {
  Looked(device(), damaged, 12);
  Looked(device(), clean, 30);
  Looked(device(), silence, 2);
  EXPECT_THAT(Say()[0],
              ::testing::StartsWith("2 of 32 exchanges failed: its replies come damaged"));
  Looked(device(), silence, 20);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("get no answer")) << "now there are more of these";
  device().findings = {};
  device().findings.Add({.symptom = damaged}, kNow.instant - 5min);
  device().findings.Add({.symptom = damaged}, kNow.instant - 5min);
  for (int i = 0; i < 2; ++i) {
    device().findings.Add({.symptom = clean}, kNow.instant);
    device().findings.Add({.symptom = silence}, kNow.instant);
  }
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("get no answer")) << "those of two minutes count";
}

TEST_F(HypothesesTest, OfSeveralKindsTheCauseThatWasSaidStaysUntilAnotherIsClearlyStronger) {
  const auto say = [this](std::uint32_t damages, std::uint32_t silences) {
    Looked(device(), damaged, damages);
    Looked(device(), silence, silences);
    Looked(device(), clean, 8);
    const bool damage = Say()[0].find("come damaged") != std::string::npos;
    return std::string(damage ? "damage" : "losses");
  };
  EXPECT_EQ(say(18, 14), "damage");
  EXPECT_EQ(say(15, 17), "damage");
  EXPECT_EQ(say(10, 22), "losses");
  EXPECT_EQ(say(17, 15), "losses");
  EXPECT_EQ(say(28, 4), "damage");
}

/// docs/status.md has a row for each, and none besides.
TEST_F(HypothesesTest, TheTableOfTheDocsHasThemAll) {
  std::ifstream file("docs/status.md");
  const std::string docs{std::istreambuf_iterator<char>(file), {}};
  const auto begin = docs.find("### Causes");
  const std::string table = docs.substr(begin, docs.find("\n## ", begin) - begin);
  for (const Hypothesis& hypothesis : Hypotheses()) {
    EXPECT_NE(table.find("*" + std::string(hypothesis.cause)), std::string::npos)
        << hypothesis.cause;
  }
  std::size_t rows = 0;
  for (auto at = table.find("\n| *"); at != std::string::npos; at = table.find("\n| *", at + 1))
    ++rows;
  EXPECT_EQ(rows, Hypotheses().size()) << "a row is a cause";
}

}  // namespace
}  // namespace baudgate::control
