// Tests clients that write to all addresses as fast as they can.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sys/socket.h>

#include <atomic>
#include <random>
#include <set>
#include <thread>

#include "tests/support/long_run.h"
#include "tests/system/messages.h"
#include "tests/system/tapped_cable.h"
#include "tests/system/writers.h"

namespace baudgate::system_test {
namespace {

constexpr std::uint8_t kHostileUnit = 1;
constexpr double kMost = 5;  // V, of output_0, the only writable output
const std::size_t kFrames = LongRun(20'000);
constexpr int kGoodWrites = 15;

class Attack {
 public:
  explicit Attack(unsigned seed) : random_(seed) {}

  Message Next() {
    const std::uint16_t address = Address();
    Bytes pdu;
    switch (Pick(8)) {
      case 0:
        pdu = {5, High(address), Low(address), Pick(2) != 0 ? std::uint8_t{0xFF} : std::uint8_t{0},
               0};
        break;
      case 1:
        pdu = {6, High(address), Low(address), Byte(), 1};
        break;
      case 2:
        pdu = {15, High(address), Low(address), 0, 8, 1, Byte()};
        break;
      case 3:
        pdu = {22, High(address), Low(address), Byte(), Byte(), Byte(), Byte()};
        break;
      case 4:  // a permitted value for one output or for all four outputs
        return Floats(0, {"4.5"});
      case 5:
        return Floats(0, {"4.5", "4.5", "4.5", "4.5"});
      case 6:
        return Floats(static_cast<std::uint16_t>(2 * Pick(4)), {std::to_string(Pick(40)) + ".25"});
      default:
        pdu = {16, High(address), Low(address), 0, 2, 4, Byte(), Byte(), Byte(), Byte()};
    }
    return {++transaction_, Pick(8) == 0 ? Byte() : kHostileUnit, pdu};
  }

  Bytes Half() {
    Bytes bytes(1 + Pick(40));
    for (std::uint8_t& byte : bytes) byte = Byte();
    if (Pick(2) == 0) bytes = {0, 1, 0, 0, 0, 11, kHostileUnit, 16, 0, 0, 0, 2, 4};
    return bytes;
  }

 private:
  static std::uint8_t High(std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8U); }
  static std::uint8_t Low(std::uint16_t word) { return static_cast<std::uint8_t>(word & 0xFFU); }
  unsigned Pick(unsigned count) { return static_cast<unsigned>(random_() % count); }
  std::uint8_t Byte() { return static_cast<std::uint8_t>(random_()); }
  std::uint16_t Address() {
    const unsigned far[] = {60000, 40000, 20000, 9000, 0};
    return static_cast<std::uint16_t>(far[Pick(5)] + Pick(120));
  }
  Message Floats(std::uint16_t address, const std::vector<std::string>& values) {
    Bytes pdu = {16,
                 High(address),
                 Low(address),
                 0,
                 static_cast<std::uint8_t>(2 * values.size()),
                 static_cast<std::uint8_t>(4 * values.size())};
    for (const std::string& value : values) {
      for (const std::uint16_t word : RegistersOf(value)) {
        pdu.push_back(High(word));
        pdu.push_back(Low(word));
      }
    }
    return {++transaction_, kHostileUnit, pdu};
  }

  std::mt19937 random_;
  std::uint16_t transaction_ = 0;
};

void Drain(const RawClient& client) {
  char waste[4096];
  while (::recv(client.socket(), waste, sizeof waste, MSG_DONTWAIT) > 0) {
  }
}

class HostileWrites : public RouteStation {
 protected:
  std::string Yaml() const {
    return RouteStation::Yaml(
        {},
        Line(
            "io", "dcon",
            "address: 1, profile: icpdas-i-7024, unit: 1, poll: 200ms, slow: 1s, write: [output_0, "
            "output_1, output_2, clear_host_watchdog], points: [{ name: output_0, max: 5 }, { "
            "name: output_1, select: true }, { name: output_2, allow_when: { point: "
            "io.io-1.host_watchdog, is: 4 } }, { name: clear_host_watchdog, select: true }]"));
  }

  void Flood(unsigned seed) {
    Attack attack(seed);
    while (!stop_) {
      const RawClient client(port(), "127.0.0.2");  // another host than that of the good client
      ++connections_;
      while (!stop_ && SendWhole(client, attack.Next())) {
        ++sent_;
        Drain(client);
      }
    }
  }
  void Litter(unsigned seed) {
    Attack attack(seed);
    while (!stop_) {
      const RawClient client(port(), "127.0.0.2");  // another host than that of the good client
      for (int i = 0; i < 50 && !stop_ && client.SendSome(attack.Half()); ++i) {
        for (int k = 0; k < 20 && client.SendSome(FrameOf(attack.Next())); ++k) {
        }
      }
    }
  }
  static bool SendWhole(const RawClient& client, const Message& message) {
    const Bytes frame = FrameOf(message);
    return client.Send(frame) == frame.size();
  }

  std::atomic<std::size_t> connections_ = 0;
  std::atomic<bool> stop_ = false;
  std::atomic<std::size_t> sent_ = 0;
};

/// Returns 4.5 for "#010+04.500" (4.5 V for output 0); nothing for other requests.
std::optional<double> VoltsOfOutput0(const std::string& request) {
  if (!request.starts_with("#010") || request.size() != 11) return std::nullopt;
  return std::stod(request.substr(4));
}

TEST_F(HostileWrites, NeitherBreakTheRulesNorDisturbOtherClients) {
  const auto twin = StartTwin("module", "icpdas-i-7024", "1");
  const TappedCable cable(LinkOf("io"), LinkOf("module"));
  const auto daemon = StartGateway(Yaml(), {"io"});
  ModbusClient good(port());
  const auto is_good = [&](int address) {
    return good.Register(kHostileUnit, 20000 + address) == kGood;
  };
  ASSERT_TRUE(Eventually([&] { return is_good(6) && is_good(26) && is_good(110); }))
      << daemon->Errors();
  ASSERT_TRUE(Eventually([&] { return cable.Requests().size() > 60; }));
  const std::vector<std::string> quiet = cable.Requests();
  const std::set<std::string> polls(quiet.begin(), quiet.end());

  std::vector<std::thread> crowd;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    crowd.emplace_back([this, seed] { seed < 3 ? Flood(seed) : Litter(seed); });
  }
  int written = 0;
  const bool enough = Eventually(
      [&] {
        const std::string volts = "1.0" + std::to_string(10 + written % 90);
        EXPECT_EQ(good.WriteRegisters(kHostileUnit, 0, RegistersOf(volts)), kNoException)
            << written;
        EXPECT_TRUE(Eventually([&] { return good.Float(kHostileUnit, 2).has_value(); }))
            << "what is polled is served, if late";
        ++written;
        const auto slow = std::ranges::count(cable.Requests(), std::string("$0170"));
        return HasFailure() || (written >= kGoodWrites && sent_ >= kFrames &&
                                slow >= 5 + std::ranges::count(quiet, std::string("$0170")));
      },
      60s);
  stop_ = true;
  for (std::thread& thread : crowd) thread.join();
  EXPECT_TRUE(enough) << written << " good writes, " << sent_ << " hostile ones";
  EXPECT_TRUE(Eventually([&] { return is_good(0) && is_good(26); }));
  EXPECT_TRUE(daemon->Running());

  std::size_t allowed = 0;
  std::size_t hostile = 0;
  for (const std::string& request : cable.Requests()) {
    if (const auto volts = VoltsOfOutput0(request)) {
      EXPECT_GE(*volts, 0) << request;
      EXPECT_LE(*volts, kMost) << request;
      ++allowed;
      hostile += *volts > 2 ? 1 : 0;
    } else {
      EXPECT_TRUE(polls.contains(request)) << request;
    }
  }
  EXPECT_GT(hostile, 0U) << "they have written what they may";
  std::cout << sent_ << " hostile writes on " << connections_ << " connections, " << written
            << " good ones, " << allowed << " on the wire\n";
}

}  // namespace
}  // namespace baudgate::system_test
