// Tests reloads of listeners and routes, also with a port that cannot be opened.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>

#include "tests/support/raw_client.h"
#include "tests/system/messages.h"
#include "tests/system/routes_fixture.h"
#include "tests/system/steady_client.h"

namespace baudgate::system_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kMoreUnits = "{ units: 33-40, line: drive, remap: 1 }";

class Taken {
 public:
  explicit Taken(std::uint16_t port) : acceptor_(io_, {asio::ip::address_v4::loopback(), port}) {}

 private:
  asio::io_context io_;
  asio::ip::tcp::acceptor acceptor_;
};

class ReloadModbus : public Routes {
 protected:
  static std::string At(std::uint16_t port, const std::string& keys = {}) {
    return "{ at: \"127.0.0.1:" + std::to_string(port) + "\"" + keys + " }";
  }
  std::string Of(const std::vector<std::string>& routes,
                 const std::vector<std::string>& more_listeners = {}) const {
    return Yaml(routes, BareLine("drive"), more_listeners);
  }
  Finished Reload(const std::string& yaml, std::vector<std::string> words = {}) const {
    Write("baudgate.yaml", yaml);
    words.insert(words.begin(), "reload");
    words.insert(words.end(), {"--socket", socket()});
    return Command(words);
  }
  std::string PlaceOf(std::uint16_t port) const { return "127.0.0.1:" + std::to_string(port); }

  static bool ReadsRoute(ModbusClient& client) {
    return client.Holding(kUnit, 7, 1).values == std::vector<std::uint16_t>{1007};
  }
  static bool ReadsGateway(ModbusClient& client) { return client.Input(255, 9000, 4).ok(); }

  const ScriptedSlave slave_{LinkOf("drive"), Answer};
  const std::uint16_t more_ = FreePort();
};

TEST_F(ReloadModbus, ChangedListenersAndRoutesDoNotDisturbTheOthers) {
  const auto daemon = StartGateway(Of({kRoute}));
  SteadyClient routed(port(), ReadsRoute);
  SteadyClient own(port(), ReadsGateway);
  ASSERT_TRUE(routed.GoesOn() && own.GoesOn());
  const std::string place = PlaceOf(more_);
  for (int round = 0; round < 3; ++round) {
    const Finished more = Reload(Of({kMoreUnits, kRoute}, {At(more_)}));
    EXPECT_EQ(more.code, 0) << more.errors;
    EXPECT_EQ(more.output, "listener " + place +
                               ": is new\nroute 33-40 to drive: is new\n"
                               "1 listener new, 1 route new; 1 line untouched\n");
    ModbusClient client(more_);
    EXPECT_EQ(client.Holding(34, 5, 1).values, std::vector<std::uint16_t>{1005});
    EXPECT_EQ(Route("33-40")["ok"], 1) << "its counters are new";
    EXPECT_EQ(Status()["modbus"]["routes"][0]["units"], "33-40") << "as in the file";
    ASSERT_TRUE(routed.GoesOn() && own.GoesOn());

    const Finished less = Reload(Of({kRoute}));
    EXPECT_EQ(less.output, "listener " + place +
                               ": ends; its client is disconnected\nroute 33-40 to drive: ends\n"
                               "1 listener removed, 1 route removed; 1 line untouched\n")
        << less.errors;
    EXPECT_FALSE(RawClient(more_).connected());
    EXPECT_EQ(ModbusClient(port()).Holding(34, 5, 1).exception, kNoPath);
    EXPECT_EQ(Status()["modbus"]["routes"].size(), 1U);
    ASSERT_TRUE(routed.GoesOn() && own.GoesOn());
  }
  EXPECT_EQ(routed.Stop(), 0) << "of " << routed.asked();
  EXPECT_EQ(own.Stop(), 0) << "of " << own.asked();
  EXPECT_EQ(Route("20")["requests"], routed.asked()) << "it kept its counters";
  EXPECT_EQ(Route("20")["ok"], routed.asked());
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

TEST_F(ReloadModbus, AddsARouteWithEventsOnAndNoDevices) {
  const std::string events = "events: {}\n";
  const auto daemon = StartGateway(events + Of({kRoute}));
  const Finished reload = Reload(events + Of({kMoreUnits, kRoute}, {At(more_)}));
  EXPECT_EQ(reload.code, 0) << reload.errors;
  EXPECT_EQ(ModbusClient(more_).Holding(34, 5, 1).values, std::vector<std::uint16_t>{1005});
}

TEST_F(ReloadModbus, AnOccupiedPortRefusesTheWholeReload) {
  const auto daemon = StartGateway(Of({kRoute}));
  SteadyClient steady(port(), ReadsRoute);
  ASSERT_TRUE(steady.GoesOn());
  const std::string yaml = Of({kMoreUnits, kRoute}, {At(FreePort()), At(more_)});
  {
    const Taken taken(more_);
    const Finished reload = Reload(yaml);
    EXPECT_EQ(reload.code, 4);
    EXPECT_THAT(reload.errors, AllOf(HasSubstr("listener " + PlaceOf(more_) + ": address already"),
                                     HasSubstr("choose another port in modbus.listen"),
                                     HasSubstr("nothing is changed")));
  }
  EXPECT_EQ(ModbusClient(port()).Holding(34, 5, 1).exception, kNoPath);
  EXPECT_EQ(Status()["modbus"]["routes"].size(), 1U);
  EXPECT_EQ(Reload(Of({kRoute})).output, "nothing has changed\n");
  const Finished again = Reload(yaml);
  EXPECT_EQ(again.code, 0) << again.errors;
  EXPECT_THAT(again.output, HasSubstr("2 listeners new, 1 route new"));
  EXPECT_EQ(steady.Stop(), 0) << "of " << steady.asked();
}

TEST_F(ReloadModbus, ChangingOneAddressToAllAddressesNeedsARestart) {
  const auto daemon = StartGateway(Of({kRoute}, {At(more_)}));
  const std::string all = "0.0.0.0:" + std::to_string(more_);
  for (const char* dry : {"--dry-run", ""}) {
    const Finished reload =
        Reload(Of({kRoute}, {"{ at: \"" + all + "\", allow: 10.0.0.0/8 }"}),
               *dry == 0 ? std::vector<std::string>{} : std::vector<std::string>{dry});
    EXPECT_EQ(reload.code, 2);
    EXPECT_THAT(reload.errors, HasSubstr("only a restart can change modbus.listen from " +
                                         PlaceOf(more_) + " to " + all));
  }
  ModbusClient client(more_);
  EXPECT_TRUE(ReadsRoute(client));
}

TEST_F(ReloadModbus, ARollbackRestoresListenersAndRoutes) {
  const auto daemon = StartGateway(Of({kRoute}, {At(more_)}));
  SteadyClient steady(port(), ReadsRoute);
  ASSERT_TRUE(steady.GoesOn());
  const std::uint16_t other = FreePort();
  ASSERT_EQ(Reload(Of({kMoreUnits, kRoute}, {At(other)}), {"--confirm", "2s"}).code, 0);
  EXPECT_TRUE(ModbusClient(other).Holding(34, 5, 1).ok());
  EXPECT_FALSE(RawClient(more_).connected());
  ASSERT_TRUE(EventuallyLogged(*daemon, "is not in use: nobody ran 'baudgate confirm' in time"));
  EXPECT_TRUE(Eventually([&] { return ModbusClient(more_).Holding(kUnit, 7, 1).ok(); }));
  EXPECT_FALSE(RawClient(other).connected());
  EXPECT_EQ(ModbusClient(port()).Holding(34, 5, 1).exception, kNoPath);
  EXPECT_EQ(steady.Stop(), 0) << "of " << steady.asked();
}

/// The listener of the trial and the confirmed listener cannot be open together.
TEST_F(ReloadModbus, ARollbackOfASecondTrialReopensTheConfirmedPort) {
  const auto daemon = StartGateway(Of({kRoute}, {At(more_)}));
  ASSERT_EQ(Reload(Of({kRoute}, {At(FreePort())}), {"--confirm", "60s"}).code, 0);
  const std::string all = "0.0.0.0:" + std::to_string(more_);
  const Finished second =
      Reload(Of({kRoute}, {"{ at: \"" + all + "\", allow: 10.0.0.0/8 }"}), {"--confirm", "2s"});
  ASSERT_EQ(second.code, 0) << second.errors;
  ASSERT_TRUE(EventuallyLogged(*daemon, "is not in use: nobody ran 'baudgate confirm' in time"));
  EXPECT_TRUE(Eventually([&] { return ModbusClient(more_).Holding(kUnit, 7, 1).ok(); }));
  EXPECT_EQ(Status()["modbus"]["closed"].size(), 0U);
}

TEST_F(ReloadModbus, AnIncompleteRollbackNamesTheMissingListenerAndRetries) {
  const auto daemon = StartGateway(Of({kRoute}, {At(more_)}));
  const std::uint16_t other = FreePort();
  ASSERT_EQ(Reload(Of({kMoreUnits, kRoute}, {At(other)}), {"--confirm", "2s"}).code, 0);
  const std::string missing =
      "not working yet: listener " + PlaceOf(more_) + ": address already in use";
  {
    const Taken taken(more_);
    ASSERT_TRUE(EventuallyLogged(*daemon, missing)) << daemon->Errors();
    EXPECT_TRUE(Eventually([&] { return !RawClient(other).connected(); }));
    EXPECT_EQ(ModbusClient(port()).Holding(34, 5, 1).exception, kNoPath);
    EXPECT_THAT(Ask({"status"}).output,
                HasSubstr("listener " + PlaceOf(more_) + ": is not open: address already in use"));
  }
  EXPECT_TRUE(Eventually([&] { return ModbusClient(more_).Holding(kUnit, 7, 1).ok(); }));
  EXPECT_EQ(Status()["modbus"]["closed"].size(), 0U);
  EXPECT_EQ(Reload(Of({kRoute}, {At(more_)})).output, "nothing has changed\n");
}

}  // namespace
}  // namespace baudgate::system_test
