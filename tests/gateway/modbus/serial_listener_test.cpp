// A scripted master at the far end of a pty: what it is answered, and what not.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/serial_listener.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <asio/executor_work_guard.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocols/modbus/protocol.h"
#include "tests/gateway/modbus/points.h"
#include "tests/transports/far_end.h"
#include "transports/pty.h"

namespace baudgate::modbus {
namespace {

namespace fs = std::filesystem;
using Descriptor = asio::posix::stream_descriptor;
using test::RunReady;
using test::RunUntil;

class KeepingSink : public CommandSink {
 public:
  bool Submit(WriteCommand command) override {
    commands.push_back(std::move(command));
    return true;
  }
  std::vector<WriteCommand> commands;
};

class KeepingTarget : public RouteTarget {
 public:
  bool Submit(RoutedRequest request) override {
    requests.push_back(std::move(request));
    return true;
  }
  void Forget(std::uint64_t) override { ++forgotten; }

  void Answer(std::size_t number, const std::string& pdu) {
    RoutedReply reply;
    reply.outcome = Outcome::ok;
    reply.pdu = ParseHex(pdu).value();
    reply.sent = true;
    requests.at(number).done(std::move(reply));
  }
  std::vector<RoutedRequest> requests;
  int forgotten = 0;
};

/// Unit 1: int16 at 0 (rw) with the value -2. Unit 20 goes to a line.
class SerialListenerTest : public testing::Test {
 protected:
  SerialListenerTest() {
    std::string form = (fs::temp_directory_path() / "baudgate-master-XXXXXX").string();
    folder_ = mkdtemp(form.data());
    config_.lines[0].devices[0].max_age = config_.lines[0].devices[0].dead_age = 24h;
    config_.modbus.listen.resize(1);
    listener().path = (folder_ / "port").string();
    listener().serial.baud = 19200;
    listener().serial.parity = config::Parity::even;
    listener().protocol = config::Listener::Protocol::rtu;
    listener().errors = config::Listener::Errors::silent;
    config::Route& route = config_.modbus.routes.emplace_back();
    route.first = route.last = 20;
    route.line = "drive";
    route.deadline = 1h;
  }
  ~SerialListenerTest() override {
    if (serial_) serial_->Stop();
    pty_.reset();
    fs::remove_all(folder_);
  }

  config::Listener& listener() { return config_.modbus.listen[0]; }

  void PlugIn() {
    auto pty = Pty::Create(listener().path);
    ASSERT_TRUE(pty.ok()) << pty.error();
    pty_.emplace(std::move(*pty));
    master_.emplace(Descriptor(io_, pty_->TakeMaster()));
    master_->Start();
  }
  void Unplug() {
    master_->stream().close();
    pty_->Unplug();
  }
  void Open() {
    store_.emplace(config_);
    const Sample samples[] = {{0, std::int64_t{-2}, Quality::good}};
    store_->Update(0, samples, ReadClocks(), 5ms);
    ModbusLinks links;
    links.lines = {&target_};
    service_.emplace(
        config_, *store_, sink_, [] { return GatewayInfo{}; }, ModbusLimits{}, links);
    service_->inbox()->Open(io_);
    serial_ = std::make_shared<SerialListener>(io_, listener(), *service_, ModbusRtuProtocol());
    serial_->Open();
  }
  void Begin() {
    PlugIn();
    Open();
    ASSERT_TRUE(RunUntil(io_, [&] { return serial_->is_open(); }));
  }

  std::uint64_t Damaged() const { return Master().damaged; }
  MasterStatus Master() const { return service_->book()->Status(ReadClocks()).masters.at(0); }

  static Bytes Rtu(std::uint8_t unit, const std::string& pdu) {
    return ModbusRtuProtocol().carrier->wrap(unit, ParseHex(pdu).value());
  }
  void Say(std::uint8_t unit, const std::string& pdu) { master_->Write(Rtu(unit, pdu)); }

  /// The next frame with this PDU, and nothing before it.
  void Expect(std::uint8_t unit, const std::string& pdu) {
    const Bytes frame = Rtu(unit, pdu);
    ASSERT_TRUE(RunUntil(io_, [&] { return master_->received().size() >= heard_ + frame.size(); }));
    EXPECT_EQ(ToHex(View(master_->received()).subspan(heard_)), ToHex(frame));
    heard_ = master_->received().size();
  }
  /// The master sends a write that is confirmed.
  void WriteOnce(std::size_t number) {
    Say(1, "06 00 00 00 07");
    ASSERT_TRUE(Commanded(number));
    sink_.commands[number - 1].done(Outcome::ok, "");
    Expect(1, "06 00 00 00 07");
  }
  /// An answer that is wrongly given would come within this time, on most machines.
  void ExpectSilence() {
    asio::steady_timer timer(io_, 50ms);
    bool over = false;
    timer.async_wait([&](const asio::error_code&) { over = true; });
    RunUntil(io_, [&] { return over; });
    EXPECT_EQ(ToHex(View(master_->received()).subspan(heard_)), "");
  }
  bool Asked(std::size_t count) {
    return RunUntil(io_, [&] { return target_.requests.size() >= count; });
  }
  bool Commanded(std::size_t count) {
    return RunUntil(io_, [&] { return sink_.commands.size() >= count; });
  }
  void AskForTheValue() {
    Say(1, "03 00 00 00 01");
    Expect(1, "03 02 FF FE");
  }

  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  fs::path folder_;
  config::Config config_ =
      MakeConfig({MakeDevice(1, {MakePoint(config::Type::int16, 0, config::Access::read_write)})});
  std::optional<PointStore> store_;
  KeepingSink sink_;
  KeepingTarget target_;
  std::optional<Service> service_;
  std::optional<Pty> pty_;
  std::optional<test::FarEnd<Descriptor>> master_;
  std::shared_ptr<SerialListener> serial_;
  std::size_t heard_ = 0;
};

TEST_F(SerialListenerTest, ReadsComeFromTheStore) {
  Begin();
  AskForTheValue();
  AskForTheValue();
  EXPECT_EQ(Damaged(), 0U);
}

TEST_F(SerialListenerTest, AWriteIsAnsweredWhenTheDeviceHasConfirmedIt) {
  Begin();
  Say(1, "06 00 00 00 07");
  ASSERT_TRUE(Commanded(1));
  ExpectSilence();
  sink_.commands[0].done(Outcome::ok, "");
  Expect(1, "06 00 00 00 07");
}

TEST_F(SerialListenerTest, ExceptionsOfTheUnitAreAnswered) {
  Begin();
  Say(1, "03 10 00 00 01");
  Expect(1, "83 02");
  Say(1, "06 00 00 00 07");
  ASSERT_TRUE(Commanded(1));
  sink_.commands[0].done(Outcome::refused, "no");
  Expect(1, "86 04");
}

TEST_F(SerialListenerTest, RoutedRequestsPassAsTheyAre) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(1));
  EXPECT_EQ(target_.requests[0].slave, 20);
  EXPECT_EQ(ToHex(target_.requests[0].pdu), "03 00 C8 00 01");
  target_.Answer(0, "03 02 09 C4");
  Expect(20, "03 02 09 C4");
}

TEST_F(SerialListenerTest, ARequestMayComeInAnyPieces) {
  listener().serial.baud = 300;  // so that no piece is too late on a slow machine
  Begin();
  const Bytes request = Rtu(1, "03 00 00 00 01");
  for (std::size_t cut = 1; cut < request.size(); ++cut) {
    master_->Write(Bytes(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(cut)));
    RunReady(io_);
    master_->Write(Bytes(request.begin() + static_cast<std::ptrdiff_t>(cut), request.end()));
    Expect(1, "03 02 FF FE");
  }
  for (const std::uint8_t byte : request) {
    master_->Write({byte});
    RunReady(io_);
  }
  Expect(1, "03 02 FF FE");
}

TEST_F(SerialListenerTest, AfterGarbageAndASilenceTheNextRequestIsAnswered) {
  Begin();
  Bytes bytes = ParseHex("FF 00 13 37 01 03 00").value();
  Append(bytes, View(Rtu(1, "06 00 00 00 07")));
  master_->Write(bytes);
  ASSERT_TRUE(RunUntil(io_, [&] { return Damaged() == 1; }));
  EXPECT_TRUE(sink_.commands.empty()) << "it may be another's data";
  AskForTheValue();
  EXPECT_EQ(Damaged(), 1U);
}

TEST_F(SerialListenerTest, DriverNoiseBeforeARequestIsPassedOver) {
  Begin();
  Bytes bytes = ParseHex("FF 00").value();
  Append(bytes, View(Rtu(1, "03 00 00 00 01")));
  master_->Write(bytes);
  Expect(1, "03 02 FF FE");
  EXPECT_EQ(Damaged(), 0U);
}

TEST_F(SerialListenerTest, DamageIsCountedAndNotAnswered) {
  Begin();
  Bytes request = Rtu(1, "03 00 00 00 01");
  request[3] ^= 0x01;
  master_->Write(request);
  ASSERT_TRUE(RunUntil(io_, [&] { return Damaged() == 1; }));
  ExpectSilence();
  request = Rtu(1, "06 00 00 00 07");
  request.pop_back();
  master_->Write(request);
  ASSERT_TRUE(RunUntil(io_, [&] { return Damaged() == 2; }));
  EXPECT_TRUE(sink_.commands.empty());
  AskForTheValue();
}

TEST_F(SerialListenerTest, OthersOnTheBusAreNotDisturbed) {
  Begin();
  const std::pair<std::string, std::string> exchanges[] = {
      {"03 00 C8 00 01", "03 02 09 C4"},    {"03 00 C8 00 02", "03 04 09 C4 00 CA"},
      {"06 00 08 00 02", "06 00 08 00 02"}, {"10 00 01 00 01 02 00 05", "10 00 01 00 01"},
      {"03 10 00 00 01", "83 02"},
  };
  for (const auto& [request, reply] : exchanges) {
    Bytes bytes = Rtu(5, request);
    Append(bytes, View(Rtu(5, reply)));
    Append(bytes, View(Rtu(1, "03 00 00 00 01")));
    master_->Write(bytes);
    Expect(1, "03 02 FF FE");
  }
  EXPECT_EQ(Damaged(), 0U);
  EXPECT_TRUE(sink_.commands.empty());
}

TEST_F(SerialListenerTest, UnitsThatAreNotMappedStaySilent) {
  Begin();
  Say(77, "03 00 00 00 01");
  ExpectSilence();
  AskForTheValue();
}

TEST_F(SerialListenerTest, NobodyAnswersABroadcast) {
  listener().broadcast = config::Listener::Broadcast::pass;
  Begin();
  Say(0, "06 00 08 00 00");
  ASSERT_TRUE(Asked(1));
  EXPECT_EQ(target_.requests[0].slave, 0);
  target_.Answer(0, "06 00 08 00 00");
  ExpectSilence();
  Say(0, "03 23 28 00 01");
  ExpectSilence();
  EXPECT_EQ(service_->book()->Status(ReadClocks()).clients[0].bytes_out, 0U);
  AskForTheValue();
}

TEST_F(SerialListenerTest, AnEchoIsNoRequest) {
  Begin();
  Say(1, "03 00 00 00 01");
  Expect(1, "03 02 FF FE");
  Say(1, "03 02 FF FE");
  Say(1, "06 00 00 00 07");
  ASSERT_TRUE(Commanded(1));
  sink_.commands[0].done(Outcome::ok, "");
  Expect(1, "06 00 00 00 07");
  Say(1, "06 00 00 00 07");
  ExpectSilence();
  EXPECT_EQ(sink_.commands.size(), 1U);
  Say(1, "06 00 00 00 07");
  ASSERT_TRUE(Commanded(2)) << "the master repeats it";
}

TEST_F(SerialListenerTest, WithoutAnEchoAWriteMayBeRepeatedAtOnce) {
  Begin();
  AskForTheValue();
  ExpectSilence();
  for (std::size_t i = 1; i <= 3; ++i) WriteOnce(i);
}

TEST_F(SerialListenerTest, ALateEchoOfTheFirstWriteIsNotCarriedOut) {
  Begin();
  WriteOnce(1);
  ExpectSilence();
  Say(1, "06 00 00 00 07");
  Expect(1, "86 06");
  Say(1, "86 06");
  ExpectSilence();
  EXPECT_EQ(sink_.commands.size(), 1U);
  WriteOnce(2);
  ExpectSilence();
  Say(1, "06 00 00 00 07");
  ExpectSilence();
  EXPECT_EQ(sink_.commands.size(), 2U) << "the adapter is known to echo";
  WriteOnce(3);
}

TEST_F(SerialListenerTest, AMasterThatOnlyEverWritesTheSameIsPutOffOnce) {
  Begin();
  WriteOnce(1);
  ExpectSilence();
  Say(1, "06 00 00 00 07");
  Expect(1, "86 06");
  ExpectSilence();
  for (std::size_t i = 2; i <= 4; ++i) WriteOnce(i);
}

TEST_F(SerialListenerTest, AnEchoThatComesWhileAnotherRequestIsUnderWayIsPassedOver) {
  Begin();
  WriteOnce(1);
  ExpectSilence();
  Bytes bytes = Rtu(20, "03 00 C8 00 01");
  Append(bytes, View(Rtu(1, "06 00 00 00 07")));
  master_->Write(bytes);
  ASSERT_TRUE(Asked(1));
  ExpectSilence();
  target_.Answer(0, "03 02 09 C4");
  Expect(20, "03 02 09 C4");
  EXPECT_EQ(sink_.commands.size(), 1U);
}

TEST_F(SerialListenerTest, AnEchoIsNoFrameOfTheBus) {
  Begin();
  AskForTheValue();
  Say(1, "03 02 FF FE");
  WriteOnce(1);
  Say(1, "06 00 00 00 07");
  ExpectSilence();
  EXPECT_EQ(Master().frames, 2U);
}

TEST_F(SerialListenerTest, AMasterThatAsksAnewHasGivenUp) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(1));
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(2));
  target_.Answer(0, "03 02 AA AA");
  ExpectSilence();
  target_.Answer(1, "03 02 BB BB");
  Expect(20, "03 02 BB BB");
  AskForTheValue();
}

TEST_F(SerialListenerTest, AMasterThatAsksAnotherSlaveHasGivenUp) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(1));
  Say(5, "03 00 C8 00 01");
  ASSERT_TRUE(RunUntil(io_, [&] { return Master().frames == 2; }));
  target_.Answer(0, "03 02 AA AA");
  ExpectSilence();
}

TEST_F(SerialListenerTest, BytesBehindARequestAreHeardOutBeforeTheReply) {
  Begin();
  Bytes bytes = Rtu(1, "03 00 00 00 01");
  bytes.push_back(0x00);
  bytes.push_back(0x03);
  master_->Write(bytes);
  Expect(1, "03 02 FF FE");
  EXPECT_EQ(Damaged(), 1U) << "it was sent into what might have become a request";
}

TEST_F(SerialListenerTest, AReplyKeepsTheQuietOfTheBus) {
  listener().serial.baud = 300;
  Begin();
  const Instant asked = std::chrono::steady_clock::now();
  AskForTheValue();
  // Longer on a slow machine, never shorter: 3.5 characters of 11 bits.
  EXPECT_GE(std::chrono::steady_clock::now() - asked, 128ms);
}

TEST_F(SerialListenerTest, TheMasterIsAClientLikeOthers) {
  Begin();
  AskForTheValue();
  const TrafficStatus traffic = service_->book()->Status(ReadClocks());
  ASSERT_EQ(traffic.clients.size(), 1U);
  EXPECT_EQ(traffic.clients[0].peer, listener().path);
  EXPECT_EQ(traffic.clients[0].requests, 1U);
  EXPECT_EQ(traffic.clients[0].bytes_in, 8U);
  EXPECT_EQ(traffic.clients[0].bytes_out, 7U);
}

TEST_F(SerialListenerTest, RequestsToOthersAreNotCountedAsItsOwn) {
  Begin();
  for (int i = 0; i < 5; ++i) Say(5, "03 00 C8 00 01");
  AskForTheValue();
  EXPECT_EQ(Master().frames, 6U);
  EXPECT_EQ(service_->book()->Status(ReadClocks()).clients[0].requests, 1U);
}

TEST_F(SerialListenerTest, AnAbsentPortIsOpenedWhenItAppearsAndAgainWhenItReturns) {
  Open();
  ASSERT_TRUE(RunUntil(io_, [&] { return Master().text != "not opened yet"; }));
  EXPECT_FALSE(serial_->is_open());
  EXPECT_FALSE(Master().is_open);
  for (int i = 0; i < 2; ++i) {
    PlugIn();
    ASSERT_TRUE(RunUntil(io_, [&] { return serial_->is_open(); }));
    heard_ = 0;
    EXPECT_TRUE(Master().is_open);
    EXPECT_EQ(Master().frames, static_cast<std::uint64_t>(i));
    AskForTheValue();
    EXPECT_EQ(Master().frames, static_cast<std::uint64_t>(i) + 1);
    EXPECT_NE(Master().last_frame, WallTime{});
    Unplug();
    ASSERT_TRUE(RunUntil(io_, [&] { return !serial_->is_open(); }));
    EXPECT_FALSE(Master().is_open);
    EXPECT_TRUE(service_->book()->Status(ReadClocks()).clients.empty());
  }
}

TEST_F(SerialListenerTest, WhatIsAnsweredAfterTheEndIsDropped) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_TRUE(Asked(1));
  Unplug();
  ASSERT_TRUE(RunUntil(io_, [&] { return !serial_->is_open(); }));
  EXPECT_EQ(target_.forgotten, 1);
  target_.Answer(0, "03 02 09 C4");
  serial_->Stop();
  serial_.reset();
  RunReady(io_);
}

}  // namespace
}  // namespace baudgate::modbus
