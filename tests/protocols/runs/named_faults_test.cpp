// Tests the sentences of `baudgate status` after half a minute of a fault: each kind of fault on
// each protocol, on one device beside a healthy one or on all devices of a line, permanent or
// occasional. The first sentence must name cause and remedy, and no sentence must blame anything
// else. BAUDGATE_SHOW=1 prints all sentences.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <bit>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <regex>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "gateway/diagnosis/causes/diagnose.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate::protocols {
namespace {

struct Stage {
  Rig& rig;
  const Setup& setup;
  VirtualLine::WireTwin& twin;
  std::uint32_t device;
  std::function<bool()> strikes;
};

struct FaultRow {
  const char* name;
  void (*apply)(Stage);
  /// A regular expression that the sentence of the device or its line must match.
  const char* says;
  const char* never = "$^";
  bool often_only = false;
  bool (*fits)(const Setup&) = [](const Setup&) { return true; };
};

bool IsTcp(const Setup& setup) { return setup.protocol->tcp; }
bool IsSerial(const Setup& setup) { return !setup.protocol->tcp; }
bool IsSevenBit(const Setup& setup) {
  return setup.protocol->data_bits == 7 && setup.serial.data_bits == 7;
}
bool IsModbus(const Setup& setup) { return setup.protocol->name.starts_with("modbus"); }
bool IsRtu(const Setup& setup) { return setup.protocol->name == "modbus_rtu"; }

void Distort(Stage stage, std::function<Bytes(Bytes)> how) {
  stage.twin.manner.distort = [stage, how = std::move(how)](Bytes reply) {
    return stage.strikes() ? how(std::move(reply)) : reply;
  };
}

Bytes Random(std::size_t size, std::uint32_t seed) {
  std::mt19937 random(seed);
  Bytes bytes(size);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

void DeliverAt(Stage stage, Duration at) {
  stage.twin.manner.deliver = [stage, at](View, Bytes reply, Instant) {
    if (reply.empty()) return std::vector<tools::TimedPiece>{};
    return std::vector<tools::TimedPiece>{
        {stage.strikes() ? at : Duration(20ms), std::move(reply)}};
  };
}

void Pieces(Stage stage, std::size_t size, Duration pause) {
  stage.twin.manner.deliver = [stage, size, pause](View, Bytes reply, Instant) {
    std::vector<tools::TimedPiece> pieces;
    Duration at = 20ms;
    const bool struck = stage.strikes();
    for (std::size_t i = 0; i < reply.size(); i += struck ? size : reply.size()) {
      const auto end = std::min(reply.size(), i + (struck ? size : reply.size()));
      pieces.push_back({at, Bytes(reply.begin() + static_cast<std::ptrdiff_t>(i),
                                  reply.begin() + static_cast<std::ptrdiff_t>(end))});
      at += pause;
    }
    return pieces;
  };
}

config::Timing TimingOf(Stage stage) { return stage.rig->StatusOf(stage.device).timing; }

Bytes Exception(const Setup& setup, View request, std::uint8_t code) {
  if (setup.protocol->tcp) {
    Bytes reply(request.begin(), request.begin() + 7);
    reply[4] = 0;
    reply[5] = 3;
    reply.push_back(request[7] | 0x80U);
    reply.push_back(code);
    return reply;
  }
  const auto asked = setup.protocol->carrier->unwrap_request(request);
  return setup.protocol->carrier->wrap(
      asked->first, Bytes{static_cast<std::uint8_t>(asked->second[0] | 0x80U), code});
}

template <std::uint8_t kCode>
void Refuse(Stage stage) {
  stage.twin.manner.instead = [stage](View request) -> std::optional<Bytes> {
    if (!stage.strikes()) return std::nullopt;
    return Exception(stage.setup, request, kCode);
  };
}

const FaultRow kFaults[] = {
    {"dead",
     [](Stage stage) {
       stage.twin.manner.distort = [stage](Bytes reply) {
         return stage.strikes() ? Bytes() : reply;
       };
     },
     "not a byte came.*(power|unit|server)|now and then a request|stops? answering|did not answer",
     "gap|second master|full"},
    {"late", [](Stage stage) { DeliverAt(stage, *TimingOf(stage).reply + 60ms); },
     "set timing: \\{ reply: ", "gap|second master|power|full"},
    {"very late", [](Stage stage) { DeliverAt(stage, *TimingOf(stage).ceiling + 300ms); },
     "set timing: \\{ reply: |late|other requests", "gap:|power", true},
    {"pieces", [](Stage stage) { Pieces(stage, 4, *TimingOf(stage).gap + 30ms); },
     "set timing: \\{ gap: ", "second master|power|bit rate", false,
     [](const Setup& setup) { return setup.protocol->name != "modbus_tcp"; }},
    {"dribble", [](Stage stage) { Pieces(stage, 1, *TimingOf(stage).gap + 30ms); },
     "set timing: \\{ gap: |without an end", "second master|power", true},
    {"pause",
     [](Stage stage) {
       stage.twin.manner.deliver = [stage](View, Bytes reply, Instant) {
         if (reply.size() < 2 || !stage.strikes())
           return std::vector<tools::TimedPiece>{{20ms, std::move(reply)}};
         const auto half = reply.begin() + static_cast<std::ptrdiff_t>(reply.size() / 2);
         return std::vector<tools::TimedPiece>{{20ms, Bytes(reply.begin(), half)},
                                               {420ms, Bytes(half, reply.end())}};
       };
     },
     "set timing: \\{ gap: ", "second master|power|bit rate|break off", false, IsSerial},
    {"framed",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         Bytes framed = {0x10, 0x02};
         Append(framed, reply);
         Append(framed, Bytes{0x10, 0x03});
         return framed;
       });
     },
     "the same bytes come around its replies \\(10 02 ... 10 03\\)", "noise|gap|second master",
     true, IsSerial},
    {"XOFF",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         reply.insert(reply.begin() + static_cast<std::ptrdiff_t>(reply.size() / 2), 0x13);
         return reply;
       });
     },
     "XON and XOFF.*flow control off|XOFF|too many|come damaged", "gap|second master|power", false,
     IsSerial},
    {"head lost",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         const bool feed = reply[0] == '\n';
         reply.erase(reply.begin(), reply.begin() + (feed ? 2 : 1));
         return reply;
       });
     },
     "first byte of its replies is missing|come damaged", "gap|second master|power", false,
     IsSerial},
    {"tail lost",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         reply.resize(reply.size() / 2 + 1);
         return reply;
       });
     },
     "break off|last byte|come damaged", "gap:|second master|power"},
    {"one bit",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         reply[reply.size() / 2] ^= 0x04;
         return reply;
       });
     },
     "bit rate, parity|two devices|come damaged|check value", "gap|second master|power", false,
     IsSerial},
    {"garbage",
     [](Stage stage) {
       Distort(stage, [n = 0U](Bytes reply) mutable { return Random(reply.size() / 2 + 3, ++n); });
     },
     "bit rate|two devices|come damaged|not Modbus TCP", "gap|second master|power"},
    {"banner",
     [](Stage stage) {
       Distort(stage,
               [](Bytes) { return ToBytes("\r\nWelcome to the terminal server\r\nlogin: "); });
     },
     "text comes in place of replies|come damaged", "gap|second master|power"},
    {"zeros", [](Stage stage) { Distort(stage, [](Bytes) { return Bytes(9, 0); }); },
     "nothing but 00 or FF|come damaged|not Modbus TCP|bit rate", "gap|second master"},
    {"eighth bit",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         for (std::uint8_t& byte : reply)
           byte = static_cast<std::uint8_t>(byte | (std::popcount(byte) % 2) << 7);
         return reply;
       });
     },
     "eighth bit", "gap|second master|power", true, IsSevenBit},
    {"only echo",
     [](Stage stage) {
       stage.rig->echo = [](View request) { return Bytes(request.begin(), request.end()); };
       for (std::uint32_t i = 0; i < stage.rig.devices(); ++i)
         stage.rig->twin(i).manner.dead = true;
     },
     "only the request itself comes back.*echo: strip",
     "gap|second master|bit rate, parity or data", true, IsSerial},
    {"twice", [](Stage stage) { stage.twin.manner.copies = 2; }, "come twice|comes? twice|doubled",
     "full|gap|second master|power", true},
    {"noise before",
     [](Stage stage) {
       Distort(stage, [n = 0U](Bytes reply) mutable {
         Bytes noise = Random(6, ++n);
         Append(noise, reply);
         return noise;
       });
     },
     "bytes come before its replies|damaged|not Modbus TCP", "gap|second master|power", true,
     IsSerial},
    {"noise behind",
     [](Stage stage) {
       Distort(stage, [n = 0U](Bytes reply) mutable {
         Append(reply, Random(6, ++n));
         return reply;
       });
     },
     "bytes follow its replies|damaged", "gap|second master|power|full", true, IsSerial},
    {"outages",
     [](Stage stage) {
       stage.twin.manner.distort = [stage](Bytes reply) {
         return (stage.rig->elapsed() + 5s) % 10s < 4s ? Bytes() : reply;
       };
     },
     "[0-9]+ outages? in the last|(stops answering|did not answer) for about [345]|every 10 s",
     "gap|second master|full", true},
    {"babble", [](Stage stage) { stage.twin.manner.babble = 5s; },
     "without an end|bit rate|cannot be read", "gap:|power", true, IsSerial},
    {"exception 02", Refuse<2>,
     "exception 02, illegal data address.*(profile fit|has answered before)",
     "gap|second master|power|other requests", false, IsModbus},
    {"exception 01", Refuse<1>, "exception 01, illegal function.*(profile fit|has answered before)",
     "gap|second master|power|other requests", false, IsModbus},
    {"exception 06", Refuse<6>,
     "exception 06, device busy.*(poll it less often|end its programming)",
     "gap|second master|power|other requests", false, IsModbus},
    {"exception 0B", Refuse<0x0B>, "exception 0B.*(behind|gateway)",
     "second master|bit rate|other requests", false, IsModbus},
    {"other device",
     [](Stage stage) {
       stage.twin.manner.distort = [stage](Bytes reply) {
         if (!stage.strikes()) return reply;
         if (stage.setup.protocol->name == "spabus") {
           std::string text(AsText(reply));
           const auto at = text.find('<');
           if (at == std::string::npos) return reply;
           text.replace(at + 1, 1, "7");
           const auto colon = text.rfind(':');
           std::uint8_t sum = 0;
           for (auto i = at; i <= colon; ++i) sum ^= static_cast<std::uint8_t>(text[i]);
           text.replace(colon + 1, 2, HexByte(sum));
           return ToBytes(text);
         }
         if (stage.setup.protocol->tcp) {
           reply[6] = 7;
           return reply;
         }
         reply[0] = 7;
         reply.resize(reply.size() - 2);
         AppendCrc16(reply);
         return reply;
       };
     },
     "(slave|unit|meter) 7 answers where", "gap|power", false,
     [](const Setup& setup) {
       return setup.protocol->name != "dcon" && setup.protocol->name != "modbus_ascii" &&
              setup.name != "Set4tmSnapshot";
     }},
    {"RTU on TCP",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         Bytes rtu(reply.begin() + 6, reply.end());
         AppendCrc16(rtu);
         return rtu;
       });
     },
     "Modbus RTU come back. Set (protocol: modbus_rtu|the device to modbus_tcp)",
     "gap|power|parity", true, IsTcp},
    {"TCP on RTU",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         Bytes tcp = {0, 1, 0, 0, 0, static_cast<std::uint8_t>(reply.size() - 2)};
         Append(tcp, View(reply).first(reply.size() - 2));
         return tcp;
       });
     },
     "Modbus TCP come back. Set (protocol: modbus_tcp|the device to modbus_rtu)",
     "gap|power|parity", true, IsRtu},
    {"transaction",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         reply[0] = 0x55;
         return reply;
       });
     },
     "another transaction number", "gap|power|parity", false, IsTcp},
    {"stuck",
     [](Stage stage) {
       Distort(stage, [n = 0, last = Bytes()](Bytes reply) mutable {
         if (++n <= 5) last = std::move(reply);
         return last;
       });
     },
     "it answers every request with the same reply", "gap|power|firmware", true, IsTcp},
    {"MBAP length",
     [](Stage stage) {
       Distort(stage, [](Bytes reply) {
         reply[5] = static_cast<std::uint8_t>(reply[5] - 2);
         return reply;
       });
     },
     "header of its replies counts", "gap|power|parity", false, IsTcp},
};

std::vector<std::string> SentencesOf(Rig& rig, std::uint32_t device) {
  std::vector<bus::DeviceRecord> records(rig.devices());
  for (std::uint32_t i = 0; i < records.size(); ++i) {
    rig->store().Read(i, [&](const bus::DeviceRecord& held) { records[i] = held; });
  }
  bus::LineStatus status = rig->store().ReadLine(0);
  status.port = bus::LineStatus::Port::open;
  const config::Line& line = rig->config().lines[0];
  const Now now = rig->now();
  auto said = diagnosis::DiagnoseLine(line, status, records, now, now.instant - rig->elapsed());
  const auto more = diagnosis::DiagnoseDevice(status, records[device], records, now,
                                              now.instant - rig->elapsed());
  said.insert(said.end(), more.begin(), more.end());
  return said;
}

const Setup& SetupOf(const std::string& name) {
  return name == "ModbusTcp" ? TcpLine() : RealLine(name);
}

std::string Text(const std::vector<std::string>& said) {
  std::string text;
  for (const std::string& sentence : said) text += "\n    " + sentence;
  return text;
}

std::function<void(config::Line&)> Small(const Setup& setup) {
  return [&setup](config::Line& line) {
    for (config::Device& device : line.devices) {
      device.poll = 1s;
      device.points.resize(std::min<std::size_t>(device.points.size(), 8));
    }
    line.port = setup.protocol->tcp ? "tcp://10.0.0.7:502" : "/dev/ttyUSB0";
  };
}

class NamedFaults : public ::testing::TestWithParam<std::string> {};

enum class Extent { one, all, now_and_then };
constexpr const char* kExtents[] = {"one of two", "all", "now and then"};

TEST_P(NamedFaults, AreNamed) {
  const auto& setup = SetupOf(GetParam());
  const bool show = std::getenv("BAUDGATE_SHOW") != nullptr;
  for (const FaultRow& fault : kFaults) {
    if (!fault.fits(setup)) continue;
    for (const Extent extent : {Extent::one, Extent::all, Extent::now_and_then}) {
      if (extent == Extent::now_and_then && fault.often_only) continue;
      Rig rig(setup, Small(setup));
      std::mt19937 random(7);
      const double rate = extent == Extent::now_and_then ? 0.3 : 1;
      const auto strikes = [&random, rate] {
        return std::uniform_real_distribution<>(0, 1)(random) < rate;
      };
      for (std::uint32_t i = 0; i < (extent == Extent::all ? rig.devices() : 1); ++i) {
        fault.apply({rig, setup, rig->twin(i), i, strikes});
      }
      rig->Open();
      rig->RunFor(extent == Extent::now_and_then || fault.often_only ? 60s : 30s);
      const auto said = SentencesOf(rig, 0);
      const std::string which =
          std::string(fault.name) + ", " + kExtents[static_cast<int>(extent)] + ":";
      const std::string text = Text(said);
      if (show) std::printf("%s, %s%s\n", GetParam().c_str(), which.c_str(), text.c_str());
      ASSERT_FALSE(said.empty()) << which;
      EXPECT_TRUE(std::regex_search(text, std::regex(fault.says, std::regex::icase)))
          << which << text;
      EXPECT_FALSE(std::regex_search(said.front(), std::regex(fault.never, std::regex::icase)))
          << which << text;
    }
  }
}

TEST_P(NamedFaults, HealthyLinesGetNoAdvice) {
  const auto& setup = SetupOf(GetParam());
  Rig rig(setup, Small(setup));
  rig->Open();
  for (int look = 0; look < 60; ++look) {
    rig->RunFor(1s);
    for (std::uint32_t device = 0; device < rig.devices(); ++device) {
      for (const std::string& sentence : SentencesOf(rig, device)) {
        const bool is_name = sentence.find("reports the name") != std::string::npos;
        const bool is_early = look == 0 && sentence == "not asked yet";
        EXPECT_TRUE(is_name || is_early) << look << " s: " << sentence;
      }
    }
  }
}

TEST_P(NamedFaults, ASecondMasterIsNamed) {
  const auto& setup = SetupOf(GetParam());
  if (setup.protocol->carrier == nullptr && setup.protocol->name != "spabus") return;
  Rig rig(setup, Small(setup));
  rig->Open();
  const Bytes asks = setup.protocol->name == "spabus"
                         ? ToBytes(">9RI1:17\r")
                         : setup.protocol->carrier->wrap(9, Bytes{3, 0, 16, 0, 2});
  for (int second = 0; second < 30; ++second) {
    rig->RunFor(900ms);
    rig->Inject(asks);
    rig->RunFor(100ms);
  }
  const std::string text = Text(SentencesOf(rig, 0)) + Text(SentencesOf(rig, 1));
  EXPECT_NE(text.find("another master sends on the line: it has asked slave 9"), std::string::npos)
      << text;
}

TEST_P(NamedFaults, TheSlowDeviceIsNamedAndNotItsNeighbour) {
  const auto& setup = SetupOf(GetParam());
  Rig rig(setup, [&setup](config::Line& line) {
    Small(setup)(line);
    for (config::Device& device : line.devices) {
      device.poll = 400ms;
      device.timing.reply = 1s;
      device.timing.ceiling = 3s;
    }
  });
  rig->twin(0).manner.think = 350ms;
  rig->Open();
  rig->RunFor(90s);
  const std::string text = Text(SentencesOf(rig, 1));
  if (rig->StatusOf(1).missed < 10) return;
  EXPECT_TRUE(std::regex_search(
      text,
      std::regex(
          rig.device(0).name +
          " takes [0-9]+ % of the line's time, [0-9]+ ms per exchange\\. Poll it less often")))
      << text;
}

INSTANTIATE_TEST_SUITE_P(Lines, NamedFaults,
                         ::testing::Values("Spa9600", "Dcon115200", "Dcon9600", "Set4tm9600",
                                           "Set4tmSnapshot", "ModbusRtu19200", "ModbusAscii9600",
                                           "ModbusTcp"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace baudgate::protocols
