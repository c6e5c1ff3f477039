// Tests of Modbus/TCP Security: roles of certificates at a listener with TLS, and a server with TLS
// as the target of a route.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <asio/ip/tcp.hpp>
#include <filesystem>
#include <future>
#include <thread>

#include "gateway/outputs/modbus/upstream/upstream.h"
#include "gateway/outputs/pki/server_files.h"
#include "gateway/records/audit/security_journal.h"
#include "tests/gateway/outputs/modbus/server/server_fixture.h"
#include "tests/gateway/outputs/pki/pki_folder.h"

namespace baudgate::modbus {
namespace {

using config::Permit;
using config::RoleRights;
using config::RoleRule;
using ::testing::HasSubstr;

bool Allowed(const RoleRights& rights, std::uint8_t unit, const std::string& pdu) {
  return Permits(rights, Frame(unit, pdu));
}

TEST(RoleRights, ReadAndWriteAreRightsOfAllUnits) {
  EXPECT_TRUE(Allowed({"viewer", Permit::read}, 1, "03 00 00 00 01"));
  EXPECT_FALSE(Allowed({"viewer", Permit::read}, 1, "06 00 00 00 01"));
  EXPECT_FALSE(Allowed({"viewer", Permit::read}, 1, "2B 0E 01 00"));
  EXPECT_TRUE(Allowed({"operator", Permit::all}, 1, "06 00 00 00 01"));
}

TEST(RoleRights, ARuleNamesUnitsFunctionsAndAddresses) {
  const RoleRights rights{.role = "pump",
                          .rules = {{{{7, 9}}, {3, 6, 15, 16, 22, 23}, {{100, 119}, {200, 200}}}}};
  EXPECT_TRUE(Allowed(rights, 7, "03 00 64 00 14")) << "100-119";
  EXPECT_TRUE(Allowed(rights, 9, "06 00 C8 00 01"));
  EXPECT_FALSE(Allowed(rights, 6, "03 00 64 00 14"));
  EXPECT_FALSE(Allowed(rights, 10, "03 00 64 00 14"));
  EXPECT_FALSE(Allowed(rights, 7, "04 00 64 00 14")) << "function";
  EXPECT_FALSE(Allowed(rights, 7, "03 00 64 00 15")) << "120 is outside";
  EXPECT_FALSE(Allowed(rights, 7, "03 00 63 00 02")) << "99 is outside";
  EXPECT_FALSE(Allowed(rights, 7, "03 FF FF FF FF"));
  EXPECT_FALSE(Allowed(rights, 7, "0F 00 76 00 0A 02 CD 01")) << "118-127";
  EXPECT_TRUE(Allowed(rights, 7, "16 00 64 00 F2 00 25"));
  EXPECT_TRUE(Allowed(rights, 7, "17 00 64 00 06 00 C8 00 01 02 00 FF"));
  EXPECT_FALSE(Allowed(rights, 7, "17 00 64 00 06 00 C9 00 01 02 00 FF")) << "writes 201";
  EXPECT_FALSE(Allowed(rights, 7, "17 00 C9 00 01 00 64 00 01 02 00 FF")) << "reads 201";
}

TEST(RoleRights, ARequestWithoutWholeAddressesFitsNoRuleWithAddresses) {
  const RoleRights rights{.role = "pump", .rules = {{{}, {}, {{0, 65535}}}}};
  EXPECT_TRUE(Allowed(rights, 1, "03 00 00 00 01"));
  for (const char* pdu : {"07", "08 00 00 A5 37", "11", "2B 0E 01 00", "64 DE AD", "03", "03 00",
                          "03 00 00", "03 00 00 00", "17 00 00 00 01 00 00 00", "14 07 06"}) {
    EXPECT_FALSE(Allowed(rights, 1, pdu)) << pdu;
  }
  EXPECT_TRUE(Allowed({.role = "pump", .rules = {{{}, {8}, {}}}}, 1, "08 00 00 A5 37"));
}

/// A blocking client with its own OpenSSL, so that both ends do not share a belief.
class TlsClient {
 public:
  /// `version`: the only version that the client offers; 0: all versions.
  TlsClient(std::uint16_t port, const std::string& folder, const std::string& name, int version = 0)
      : raw_(port), context_(SSL_CTX_new(TLS_client_method())) {
    if (version != 0) {
      SSL_CTX_set_security_level(context_, 0);
      SSL_CTX_set_min_proto_version(context_, version);
      SSL_CTX_set_max_proto_version(context_, version);
    }
    SSL_CTX_load_verify_locations(context_, (folder + "/ca.pem").c_str(), nullptr);
    SSL_CTX_set_verify(context_, SSL_VERIFY_PEER, nullptr);
    if (!name.empty()) {
      SSL_CTX_use_certificate_chain_file(context_, (folder + "/" + name + ".pem").c_str());
      SSL_CTX_use_PrivateKey_file(context_, (folder + "/" + name + ".key").c_str(),
                                  SSL_FILETYPE_PEM);
    }
    ssl_ = SSL_new(context_);
    SSL_set1_host(ssl_, "localhost");
    SSL_set_fd(ssl_, raw_.socket());
    connected_ = SSL_connect(ssl_) == 1;
  }
  ~TlsClient() {
    SSL_free(ssl_);
    SSL_CTX_free(context_);
    ERR_clear_error();
  }
  TlsClient(const TlsClient&) = delete;
  TlsClient& operator=(const TlsClient&) = delete;

  bool connected() const { return connected_; }
  SSL* ssl() { return ssl_; }
  void Send(View bytes) { SSL_write(ssl_, bytes.data(), static_cast<int>(bytes.size())); }
  /// Returns the PDU of the next frame; empty: the connection has ended.
  std::string Receive() {
    Bytes frame = ReceiveExactly(kMbapPrefix);
    if (frame.empty()) return {};
    const Bytes rest = ReceiveExactly(static_cast<std::size_t>(frame[4]) << 8U | frame[5]);
    return rest.empty() ? "" : ToHex(View(rest).subspan(1));
  }
  std::string Ask(std::uint8_t unit, const std::string& pdu) {
    Send(Frame(unit, pdu));
    return Receive();
  }

 private:
  Bytes ReceiveExactly(std::size_t count) {
    Bytes bytes(count);
    for (std::size_t at = 0; at < count;) {
      const int got = SSL_read(ssl_, bytes.data() + at, static_cast<int>(count - at));
      if (got <= 0) return {};
      at += static_cast<std::size_t>(got);
    }
    return bytes;
  }

  RawClient raw_;
  SSL_CTX* context_;
  SSL* ssl_ = nullptr;
  bool connected_ = false;
};

class TlsListenerTest : public ServerTest {
 protected:
  TlsListenerTest() {
    MakeFiles();
    listener().protocol = config::Listener::Protocol::tls;
    listener().tls = {folder_.In("gateway.pem"), folder_.In("gateway.key"), folder_.In("ca.pem")};
    listener().roles = {{.role = "viewer", .permit = Permit::read},
                        {.role = "operator", .permit = Permit::all},
                        {.role = "pump", .rules = {{{{1, 1}}, {3, 6}, {{0, 0}}}}}};
    links_.journal = &journal_;
    sink_.answer = WriteEnd::ok;
  }
  ~TlsListenerTest() override { StopServer(); }

  void MakeFiles() const {
    const auto made = pki::WriteServerFiles(folder_.path().string(), {"localhost", "127.0.0.1"},
                                            {{"viewer", "viewer"},
                                             {"operator", "operator"},
                                             {"pump", "pump"},
                                             {"stranger", "guest"},
                                             {"plain", ""}},
                                            ReadClocks().wall);
    ASSERT_TRUE(made) << made.error();
  }

  TlsClient As(const std::string& name) {
    return TlsClient(server_->port(), folder_.path().string(), name);
  }

  /// Returns the rows of the journal as "kind|who without serial number|result".
  std::vector<std::string> Rows() {
    EXPECT_TRUE(journal_.Flush(5s));
    const auto checked = audit::VerifyJournal(folder_.In("journal"));
    std::vector<std::string> rows;
    if (!checked) return rows;
    for (const audit::JournalRow& row : checked->rows) {
      rows.push_back(row.event.kind + "|" + row.event.who.substr(0, row.event.who.find(" (")) +
                     "|" + row.event.result);
    }
    return rows;
  }

  pki::testing::PkiFolder folder_{"modbus-tls"};
  audit::SecurityJournal journal_{folder_.path() / "journal"};
};

TEST_F(TlsListenerTest, TheRoleOfTheCertificateDecides) {
  StartServer();
  TlsClient viewer = As("viewer");
  ASSERT_TRUE(viewer.connected());
  EXPECT_EQ(viewer.Ask(1, "03 00 00 00 01"), "03 02 FF FE");
  EXPECT_EQ(viewer.Ask(1, "06 00 00 00 05"), "86 01");
  EXPECT_EQ(sink_.count(), 0U);
  TlsClient writer = As("operator");
  EXPECT_EQ(writer.Ask(1, "03 00 00 00 01"), "03 02 FF FE");
  EXPECT_EQ(writer.Ask(1, "06 00 00 00 05"), "06 00 00 00 05");
  EXPECT_THAT(sink_.Wait(0).client, HasSubstr("CN=operator ("));
  TlsClient pump = As("pump");
  EXPECT_EQ(pump.Ask(1, "03 00 00 00 01"), "03 02 FF FE");
  EXPECT_EQ(pump.Ask(1, "03 00 00 00 02"), "83 01");
  EXPECT_EQ(pump.Ask(1, "01 00 00 00 01"), "81 01");
  EXPECT_EQ(pump.Ask(1, "06 00 00 00 05"), "06 00 00 00 05");
}

TEST_F(TlsListenerTest, ARoleWithoutRightsGetsNothing) {
  StartServer();
  for (const char* name : {"stranger", "plain"}) {
    TlsClient client = As(name);
    ASSERT_TRUE(client.connected());
    EXPECT_EQ(client.Ask(1, "03 00 00 00 01"), "83 01") << name;
    EXPECT_EQ(client.Ask(1, "06 00 00 00 05"), "86 01") << name;
    EXPECT_EQ(client.Ask(99, "03 00 00 00 01"), "83 01") << "a unit that does not exist";
  }
  EXPECT_EQ(sink_.count(), 0U);
  EXPECT_THAT(Rows(), ::testing::ElementsAre(
                          "login|CN=stranger|the role 'guest' has no rights at this listener",
                          "host||ok", "login|CN=plain|the certificate contains no role"));
}

TEST_F(TlsListenerTest, WithoutACertificateNobodyComesIn) {
  StartServer();
  TlsClient nobody = As("");
  nobody.Send(Frame(1, "03 00 00 00 01"));
  EXPECT_EQ(nobody.Receive(), "") << "TLS 1.3: the client learns it when it reads";
  const RawClient plain = Connect();
  plain.Send(Frame(1, "03 00 00 00 01"));
  EXPECT_EQ(ToHex(plain.Receive(100)), "") << "closed";
  EXPECT_EQ(As("viewer").Ask(1, "03 00 00 00 01"), "03 02 FF FE");
  const auto rows = Rows();
  EXPECT_THAT(rows, ::testing::Contains("login||it has sent no certificate"));
  EXPECT_THAT(rows, ::testing::Contains("login||it does not speak TLS"));
}

TEST_F(TlsListenerTest, ManyRequestsInOneRecordAndOneRequestInManyRecordsAreServed) {
  StartServer();
  TlsClient viewer = As("viewer");
  Bytes many;
  for (int i = 0; i < 600; ++i) Append(many, Frame(1, "03 00 00 00 01"));
  viewer.Send(many);
  for (int i = 0; i < 600; ++i) ASSERT_EQ(viewer.Receive(), "03 02 FF FE") << i;
  const Bytes one = Frame(1, "03 00 00 00 01");
  for (std::size_t cut = 1; cut < one.size(); ++cut) {
    viewer.Send(View(one).first(cut));
    viewer.Send(View(one).subspan(cut));
    ASSERT_EQ(viewer.Receive(), "03 02 FF FE") << cut;
  }
  for (const std::uint8_t byte : one) viewer.Send(View(&byte, 1));
  EXPECT_EQ(viewer.Receive(), "03 02 FF FE");
}

TEST_F(TlsListenerTest, RenewedCertificatesLeaveSessionsConnected) {
  StartServer();
  TlsClient before = As("viewer");
  EXPECT_EQ(before.Ask(1, "03 00 00 00 01"), "03 02 FF FE");
  const std::string old = pki::testing::ReadText(folder_.In("gateway.pem"));
  MakeFiles();
  ASSERT_NE(pki::testing::ReadText(folder_.In("gateway.pem")), old);
  TlsClient after = As("viewer");
  ASSERT_TRUE(after.connected());
  EXPECT_EQ(after.Ask(1, "03 00 00 00 01"), "03 02 FF FE");
  EXPECT_EQ(before.Ask(1, "03 00 00 00 01"), "03 02 FF FE");
  const auto serial = [](TlsClient& client) {
    X509* const certificate = SSL_get1_peer_certificate(client.ssl());
    const std::string text = tls::SerialOf(tls::Certificate(certificate));
    return text;
  };
  EXPECT_NE(serial(after), serial(before));
}

TEST_F(TlsListenerTest, OldVersionsAndResumptionAreRefused) {
  StartServer();
  for (const int version : {TLS1_VERSION, TLS1_1_VERSION}) {
    EXPECT_FALSE(
        TlsClient(server_->port(), folder_.path().string(), "viewer", version).connected());
  }
  TlsClient older(server_->port(), folder_.path().string(), "viewer", TLS1_2_VERSION);
  EXPECT_EQ(older.Ask(1, "03 00 00 00 01"), "03 02 FF FE");
  EXPECT_EQ(SSL_renegotiate(older.ssl()), 1);
  EXPECT_EQ(older.Ask(1, "03 00 00 00 01"), "") << "renegotiation";
  TlsClient viewer = As("viewer");
  EXPECT_EQ(SSL_version(viewer.ssl()), TLS1_3_VERSION);
  EXPECT_EQ(SSL_session_reused(viewer.ssl()), 0);
  EXPECT_EQ(SSL_SESSION_is_resumable(SSL_get_session(viewer.ssl())), 0);
}

TEST_F(TlsListenerTest, SilentClientsDelayNobody) {
  StartServer();
  std::vector<RawClient> silent;
  for (int i = 0; i < 20; ++i) silent.push_back(Connect());
  TlsClient viewer = As("viewer");
  EXPECT_EQ(viewer.Ask(1, "03 00 00 00 01"), "03 02 FF FE");
}

TEST_F(TlsListenerTest, WrongFilesDoNotPreventTheStart) {
  listener().tls.key = folder_.In("viewer.key");
  StartServer();
  EXPECT_THAT(server_->Missing(),
              ::testing::ElementsAre(HasSubstr("does not belong to the certificate")));
  EXPECT_THAT(server_->CanServe(listener()).error(), HasSubstr("does not belong"));
}

TEST_F(TlsListenerTest, ACertificateWithoutSubjectIsNamedByItsNumber) {
  EXPECT_EQ((tls::Identity{.serial = "4A01"}).Name(), "no subject (4A01)");
  EXPECT_EQ(tls::Identity{}.Name(), "");
}

TEST_F(TlsListenerTest, ARouteReachesAServerWithTls) {
  StartServer();
  asio::io_context io;
  const config::TlsFiles files{folder_.In("viewer.pem"), folder_.In("viewer.key"),
                               folder_.In("ca.pem")};
  Upstream upstream(io, "127.0.0.1", server_->port(), files, {});
  upstream.Start();
  const auto ask = [&](Upstream& at, const char* pdu) {
    bus::RoutedReply reply;
    bus::RoutedRequest request;
    request.slave = 1;
    request.pdu = ParseHex(pdu).value();
    request.arrived = ReadClocks().instant;
    request.deadline = request.arrived + 10s;
    request.done = [&](bus::RoutedReply its) {
      reply = std::move(its);
      io.stop();
    };
    EXPECT_TRUE(at.Submit(std::move(request)));
    io.restart();
    io.run();
    return reply;
  };
  EXPECT_EQ(ToHex(ask(upstream, "03 00 00 00 01").pdu), "03 02 FF FE");
  EXPECT_EQ(ToHex(ask(upstream, "06 00 00 00 05").pdu), "86 01") << "a viewer";
  Upstream other(io, "127.0.0.1", server_->port(), {.authorities = folder_.In("absent.pem")}, {});
  other.Start();
  EXPECT_THAT(ask(other, "03 00 00 00 01").reason, HasSubstr("absent.pem cannot be read"));
  Upstream nameless(io, "127.0.0.2", server_->port(), files, {});
  upstream.Stop();
  other.Stop();
  io.restart();
  io.poll();
}

}  // namespace
}  // namespace baudgate::modbus
