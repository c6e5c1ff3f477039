// Tests of `ClientPoll` and of `ClientSession`. Some tests use libmodbus as the client.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <modbus.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <deque>
#include <functional>
#include <memory>

#include "gateway/outputs/modbus/server/client_session.h"
#include "protocols/modbus/protocol.h"
#include "tests/gateway/outputs/modbus/server/server_fixture.h"
#include "tests/gateway/outputs/modbus/service/service_fixture.h"

namespace baudgate::modbus {
namespace {

class TestClient : public ClientPoll::Client {
 public:
  explicit TestClient(ClientPoll& clients) : clients_(clients) {
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends_), 0);
    EXPECT_TRUE(clients_.Add(ends_[0], *this, EPOLLIN));
  }
  ~TestClient() {
    Leave();
    ::close(ends_[0]);
    ::close(ends_[1]);
  }
  TestClient(const TestClient&) = delete;

  void Send() { EXPECT_EQ(::send(ends_[1], "x", 1, 0), 1); }
  void Leave() { clients_.Remove(ends_[0], *this); }
  void Watch(std::uint32_t events) { EXPECT_TRUE(clients_.Change(ends_[0], *this, events)); }

  void OnEvents(std::uint32_t events, const Now&) override {
    ++told;
    last_events = events;
    char byte = 0;
    if (reads) reads = ::recv(ends_[0], &byte, 1, 0) == 1;
    if (then) then();
  }

  int told = 0;
  std::uint32_t last_events = 0;
  bool reads = true;
  std::function<void()> then;

 private:
  ClientPoll& clients_;
  int ends_[2] = {-1, -1};
};

class ClientPollTest : public testing::Test {
 protected:
  ClientPollTest() {
    EXPECT_TRUE(clients_->Open().ok());
    clients_->Start();
  }
  ~ClientPollTest() override {
    all_.clear();
    clients_->Close();
  }

  TestClient& Join() { return all_.emplace_back(*clients_); }

  asio::io_context io_;
  std::shared_ptr<ClientPoll> clients_ = std::make_shared<ClientPoll>(io_);
  std::deque<TestClient> all_;
};

TEST_F(ClientPollTest, EachClientOfSeveralBatchesIsServedOnce) {
  for (int i = 0; i < 300; ++i) Join().Send();
  io_.poll();
  for (const TestClient& client : all_) EXPECT_EQ(client.told, 1);
}

TEST_F(ClientPollTest, UnreadDataIsReportedAgainAndOtherWorkStillRuns) {
  TestClient& lazy = Join();
  TestClient& other = Join();
  lazy.reads = other.reads = false;
  lazy.Send();
  other.Send();
  bool ran = false;
  clients_->Post([&](const Now&) { ran = true; });
  while (lazy.told < 1000 && io_.run_one() > 0) continue;
  EXPECT_TRUE(ran);
  EXPECT_GE(other.told, 900);
}

TEST_F(ClientPollTest, ARemovedClientIsNotNotified) {
  TestClient& first = Join();
  TestClient& second = Join();
  first.then = [&] { second.Leave(); };
  second.then = [&] { first.Leave(); };
  first.Send();
  second.Send();
  io_.poll();
  EXPECT_EQ(first.told + second.told, 1);
}

TEST_F(ClientPollTest, ASingleClientIsServedUntilAnotherClientJoins) {
  TestClient& only = Join();
  for (int i = 1; i <= 3; ++i) {
    only.Send();
    io_.poll();
    EXPECT_EQ(only.told, i);
  }
  TestClient& other = Join();
  other.Send();
  io_.poll();
  EXPECT_EQ(only.told, 3);
  EXPECT_EQ(other.told, 1);
  only.Leave();
  other.Send();
  io_.poll();
  EXPECT_EQ(only.told, 3);
  EXPECT_EQ(other.told, 2);
}

TEST_F(ClientPollTest, ASingleClientGetsOnlyTheEventsThatItWatches) {
  TestClient& only = Join();
  only.Send();
  io_.poll();
  only.Watch(0);
  only.Send();
  io_.poll();
  EXPECT_EQ(only.told, 1);
  only.then = [&] { only.Watch(0); };
  only.Watch(EPOLLOUT);
  io_.poll();
  EXPECT_EQ(only.told, 2);
  EXPECT_EQ(only.last_events, static_cast<std::uint32_t>(EPOLLOUT));
}

class ClientSessionTest : public ServiceTest, private ClientSession::Owner {
 protected:
  ~ClientSessionTest() override {
    if (session_) session_->Close();
    clients_->Close();
    ::close(client_);
  }

  void Connect() {
    links_.frames.rtu = &protocols::ModbusRtuProtocol();
    MakeShared();
    ASSERT_TRUE(clients_->Open().ok());
    clients_->Start();
    int ends[2];
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends), 0);
    client_ = ends[1];
    session_ = std::make_shared<ClientSession>(
        Accepted{.socket = ends[0], .peer = "10.0.0.7:40112"}, *clients_, listener(), *shared_,
        Clocks(), static_cast<ClientSession::Owner&>(*this));
    session_->Start();
  }
  void Say(const Bytes& bytes) {
    ASSERT_EQ(::send(client_, bytes.data(), bytes.size(), 0), std::ssize(bytes));
    static_cast<ClientPoll::Client&>(*session_).OnEvents(EPOLLIN, Clocks());
  }
  std::string Received() {
    Bytes bytes(512);
    const ssize_t count = ::recv(client_, bytes.data(), bytes.size(), 0);
    return ToHex(View(bytes).first(static_cast<std::size_t>(std::max<ssize_t>(count, 0))));
  }
  void Sweep(Duration later) {
    now_ += later;
    session_->Sweep(Clocks());
  }

  std::shared_ptr<ClientPoll> clients_ = std::make_shared<ClientPoll>(io_);
  std::shared_ptr<ClientSession> session_;
  int client_ = -1;
  int closed_ = 0;
  Instant sweep_at_ = Instant::max();

 private:
  void OnClosed(ClientSession&) override { ++closed_; }
  void SweepAt(Instant at) override { sweep_at_ = std::min(sweep_at_, at); }
};

constexpr const char* kReadFirst = "03 00 00 00 01";

TEST_F(ClientSessionTest, ACachedReadIsAnsweredAtOnce) {
  Connect();
  Say(Frame(1, kReadFirst));
  EXPECT_EQ(Received(), "12 34 00 00 00 05 01 03 02 FF FE");
  EXPECT_EQ(sweep_at_, Instant::max()) << "nothing waits";
}

TEST_F(ClientSessionTest, AnIdleClientIsClosedAfterTheIdleTimeout) {
  listener().idle_timeout = 5min;
  Connect();
  Say(Frame(1, kReadFirst));
  Sweep(5min);
  EXPECT_EQ(closed_, 0);
  Sweep(1ns);
  EXPECT_EQ(closed_, 1);
  EXPECT_EQ(shared_->counters().Snapshot().idle, 1U);
}

TEST_F(ClientSessionTest, AClientThatWaitsForARouteIsNotIdle) {
  listener().idle_timeout = 1min;
  Add(1, 20, 20).deadline = 1h;
  Connect();
  Say(Frame(20, kReadFirst));
  EXPECT_EQ(sweep_at_, now_ + 1h + PendingRequest::kGrace);
  EXPECT_EQ(session_->Deadline(), sweep_at_);
  Sweep(2min);
  EXPECT_EQ(closed_, 0);
  Sweep(1h);
  EXPECT_EQ(Received(), "12 34 00 00 00 03 14 83 0B");
  EXPECT_EQ(session_->Deadline(), std::nullopt);
}

TEST_F(ClientSessionTest, HalfAnRtuFrameIsDroppedAfter50Milliseconds) {
  listener().framing = Framing::rtu;
  Connect();
  const Bytes request =
      protocols::ModbusRtuProtocol().carrier->wrap(1, ParseHex(kReadFirst).value());
  const Bytes half(request.begin(), request.begin() + 4);
  Say(half);
  Sweep(49ms);
  Say(Bytes(request.begin() + 4, request.end()));
  EXPECT_EQ(Received(), "01 03 02 FF FE 78 34") << "it was not dropped yet";
  Say(half);
  Sweep(50ms);
  Say(request);
  EXPECT_EQ(Received(), "01 03 02 FF FE 78 34");
}

class LibmodbusTest : public ServerTest {
 protected:
  struct Free {
    void operator()(modbus_t* context) const {
      modbus_close(context);
      modbus_free(context);
    }
  };

  void ConnectLibmodbus() {
    context_.reset(modbus_new_tcp("127.0.0.1", server_->port()));
    ASSERT_NE(context_, nullptr);
    modbus_set_slave(context_.get(), 1);
    modbus_set_response_timeout(context_.get(), 20, 0);
    ASSERT_EQ(modbus_connect(context_.get()), 0);
  }

  std::unique_ptr<modbus_t, Free> context_;
};

TEST_F(LibmodbusTest, ReadsValues) {
  StartServer();
  ConnectLibmodbus();
  std::array<std::uint16_t, 3> registers{};
  ASSERT_EQ(modbus_read_registers(context_.get(), 0, 3, registers.data()), 3);
  EXPECT_EQ(registers[0], 0xFFFE);
  EXPECT_EQ(modbus_get_float_abcd(&registers[1]), 123456.0F);
  ASSERT_EQ(modbus_read_input_registers(context_.get(), 0, 3, registers.data()), 3);
  EXPECT_EQ(modbus_get_float_abcd(&registers[1]), 123456.0F);
  std::array<std::uint8_t, 2> bits{};
  ASSERT_EQ(modbus_read_bits(context_.get(), 0, 2, bits.data()), 2);
  EXPECT_EQ(bits, (std::array<std::uint8_t, 2>{1, 0}));
  ASSERT_EQ(modbus_read_input_bits(context_.get(), 20000, 2, bits.data()), 2);
  EXPECT_EQ(bits, (std::array<std::uint8_t, 2>{1, 1}));
}

TEST_F(LibmodbusTest, ReadsTheLargestBlocks) {
  std::vector<config::Point> points;
  for (std::uint16_t i = 0; i < 125; ++i) points.push_back(MakePoint(Type::int16, i));
  for (std::uint16_t i = 0; i < 2000; ++i) points.push_back(MakePoint(Type::boolean, i));
  config_.lines[0].devices.push_back(MakeDevice(2, points));
  StartServer();
  std::vector<bus::Sample> samples;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    samples.push_back({i, std::int64_t{i < 125 ? i : i % 3}, Quality::good});
  }
  const Now later{ReadClocks().instant + 1h, {}};
  store_->Update(1, samples, later, 1ms);
  ConnectLibmodbus();
  modbus_set_slave(context_.get(), 2);
  std::vector<std::uint16_t> registers(125);
  ASSERT_EQ(modbus_read_registers(context_.get(), 0, 125, registers.data()), 125);
  for (std::uint16_t i = 0; i < 125; ++i) ASSERT_EQ(registers[i], i);
  std::vector<std::uint8_t> bits(2000);
  ASSERT_EQ(modbus_read_bits(context_.get(), 0, 2000, bits.data()), 2000);
  for (std::size_t i = 0; i < 2000; ++i) ASSERT_EQ(bits[i], (i + 125) % 3 == 0 ? 0 : 1) << i;
}

TEST_F(LibmodbusTest, ReceivesExceptions) {
  StartServer();
  ConnectLibmodbus();
  std::uint16_t value = 0;
  EXPECT_EQ(modbus_read_registers(context_.get(), 4, 1, &value), -1);
  EXPECT_EQ(errno, EMBXILADD);
  EXPECT_EQ(modbus_read_registers(context_.get(), 1, 1, &value), -1);
  EXPECT_EQ(errno, EMBXILVAL);
  EXPECT_EQ(modbus_read_registers(context_.get(), 3, 1, &value), -1);
  EXPECT_EQ(errno, EMBXGTAR);
  modbus_set_slave(context_.get(), 77);
  EXPECT_EQ(modbus_read_registers(context_.get(), 0, 1, &value), -1);
  EXPECT_EQ(errno, EMBXGPATH);
}

TEST_F(LibmodbusTest, WritesValues) {
  sink_.answer = WriteEnd::ok;
  StartServer();
  ConnectLibmodbus();
  EXPECT_EQ(modbus_write_register(context_.get(), 0, 0xFFFD), 1);
  EXPECT_EQ(sink_.Wait(0).writes()[0].raw, Value(std::int64_t{-3}));
  const std::array<std::uint16_t, 3> registers = {1, 0x3F80, 0};
  EXPECT_EQ(modbus_write_registers(context_.get(), 0, 3, registers.data()), 3);
  EXPECT_EQ(sink_.Wait(1).writes()[1].raw, Value(1.0));
  EXPECT_EQ(modbus_write_bit(context_.get(), 0, 1), 1);
  EXPECT_EQ(sink_.Wait(2).writes()[0].raw, Value(true));
  const std::uint8_t off = 0;
  EXPECT_EQ(modbus_write_bits(context_.get(), 0, 1, &off), 1);
  EXPECT_EQ(sink_.Wait(3).writes()[0].raw, Value(false));
}

}  // namespace
}  // namespace baudgate::modbus
