// One client under virtual time: when it is answered, and when it is closed.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/client_session.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "protocols/modbus/protocol.h"
#include "tests/gateway/outputs/modbus/service/service_fixture.h"

namespace baudgate::modbus {
namespace {

class ClientSessionTest : public ServiceTest, private ClientSession::Owner {
 protected:
  ~ClientSessionTest() override {
    if (session_) session_->Close();
    clients_->Close();
    ::close(client_);
  }

  void Connect() {
    links_.frames.rtu = &ModbusRtuProtocol();
    MakeShared();
    ASSERT_TRUE(clients_->Open().ok());
    clients_->Start();
    int ends[2];
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends), 0);
    client_ = ends[1];
    session_ = std::make_shared<ClientSession>(ends[0], *clients_, listener(), *shared_,
                                               "10.0.0.7:40112", config::Priority::normal, Clocks(),
                                               static_cast<ClientSession::Owner&>(*this));
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

TEST_F(ClientSessionTest, AReadIsAnsweredAtOnce) {
  Connect();
  Say(Frame(1, kReadFirst));
  EXPECT_EQ(Received(), "12 34 00 00 00 05 01 03 02 FF FE");
  EXPECT_EQ(sweep_at_, Instant::max()) << "nothing waits";
}

TEST_F(ClientSessionTest, AnIdleClientIsClosedAfterItsTime) {
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
  const Bytes request = ModbusRtuProtocol().carrier->wrap(1, ParseHex(kReadFirst).value());
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

}  // namespace
}  // namespace baudgate::modbus
