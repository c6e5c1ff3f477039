// TLS connections: whose certificate is accepted, roles in certificates, renewed files, and
// connections whose bytes arrive in pieces.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <asio/error.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/read.hpp>
#include <asio/write.hpp>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>

#include "gateway/outputs/pki/demo_pki.h"
#include "gateway/outputs/pki/server_files.h"
#include "tests/gateway/outputs/pki/pki_folder.h"
#include "transports/tcp_client.h"
#include "transports/tls_handshakes.h"

namespace baudgate::tls {
namespace {

using ::testing::HasSubstr;
using ChannelResult = Result<std::unique_ptr<Channel>>;

/// Returns RoleOf for a certificate with these extensions; "!" and the error if there is one.
std::string RoleWith(const std::vector<std::string>& values) {
  const Certificate certificate(X509_new());
  for (const std::string& value : values) {
    X509V3_CTX context;
    X509V3_set_ctx(&context, nullptr, certificate.get(), nullptr, nullptr, 0);
    X509_EXTENSION* const extension =
        X509V3_EXT_conf(nullptr, &context, kRoleExtension, value.c_str());
    EXPECT_NE(extension, nullptr) << value;
    X509_add_ext(certificate.get(), extension, -1);
    X509_EXTENSION_free(extension);
  }
  const auto role = RoleOf(*certificate);
  return role ? *role : "!" + role.error();
}

TEST(TlsRole, IsExactlyOneUtf8String) {
  EXPECT_EQ(RoleWith({}), "");
  EXPECT_EQ(RoleWith({"ASN1:UTF8String:operator"}), "operator");
  EXPECT_EQ(RoleWith({"ASN1:FORMAT:UTF8,UTF8String:größe"}), "größe");
  EXPECT_THAT(RoleWith({"ASN1:UTF8String:viewer", "ASN1:UTF8String:operator"}),
              HasSubstr("!the certificate contains its role twice"));
  for (const char* other :
       {"ASN1:PRINTABLESTRING:operator", "ASN1:IA5STRING:operator", "ASN1:OCTETSTRING:operator",
        "ASN1:INTEGER:3", "DER:0C", "DER:0C02", "DER:0C026F", "DER:0C016F00", "DER:0C016F0C016F",
        "DER:30030C016F", "DER:0C81016F", "DER:2C030C016F", "DER:2C800C016F0000"}) {
    EXPECT_THAT(RoleWith({other}), HasSubstr("!the role in the certificate is not")) << other;
  }
  for (const char* wrong : {"DER:0C00", "DER:0C01FF", "DER:0C0100"}) {
    EXPECT_THAT(RoleWith({wrong}), HasSubstr("!the role in the certificate is empty")) << wrong;
  }
  EXPECT_EQ(RoleWith({"ASN1:UTF8String:" + std::string(128, 'r')}), std::string(128, 'r'));
  EXPECT_THAT(RoleWith({"ASN1:UTF8String:" + std::string(129, 'r')}), HasSubstr("too long"));
}

class TlsTest : public ::testing::Test {
 protected:
  TlsTest() {
    Write("");
    Write("other/");
  }

  void Write(const std::string& folder) const {
    const auto made =
        pki::WriteServerFiles(folder_.In(folder), {"localhost", "127.0.0.1"},
                              {{"viewer", "viewer"}, {"plain", ""}}, ReadClocks().wall);
    ASSERT_TRUE(made) << made.error();
  }

  config::TlsFiles Files(const std::string& name, const std::string& authority = "ca.pem") const {
    if (name.empty()) return {.authorities = folder_.In(authority)};
    return {folder_.In(name + ".pem"), folder_.In(name + ".key"), folder_.In(authority)};
  }

  static std::shared_ptr<ContextFiles> Made(End end, const config::TlsFiles& files) {
    return std::make_shared<ContextFiles>(end, files);
  }

  /// Runs the handshake over `server_socket` and `client_socket`.
  void Shake(int server_socket, int client_socket, const config::TlsFiles& server,
             const config::TlsFiles& client, const std::string& name = "localhost") {
    server_.reset();
    client_.reset();
    io_.restart();
    const auto server_ticket =
        handshakes_.Begin(server_socket, Made(End::server, server), "10.0.0.7:4000", io_,
                          [this](ChannelResult result) { server_ = std::move(result); });
    const auto client_ticket =
        handshakes_.Begin(client_socket, Made(End::client, client), name, io_,
                          [this](ChannelResult result) { client_ = std::move(result); });
    const auto guard = asio::make_work_guard(io_);
    while (!server_ || !client_) io_.run_one();
  }

  void Shake(const config::TlsFiles& server, const config::TlsFiles& client,
             const std::string& name = "localhost") {
    int pair[2];
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
    Shake(pair[0], pair[1], server, client, name);
  }

  /// In TLS 1.3 a client learns only from its first read that the server refuses it.
  std::string WhyRefused() const {
    EXPECT_FALSE(*server_);
    return *server_ ? "" : server_->error();
  }

  pki::testing::PkiFolder folder_{"tls"};
  asio::io_context io_;
  Handshakes handshakes_;
  std::optional<ChannelResult> server_;
  std::optional<ChannelResult> client_;
};

TEST_F(TlsTest, BothEndsKnowEachOther) {
  Shake(Files("gateway"), Files("viewer"));
  ASSERT_TRUE(*server_) << server_->error();
  ASSERT_TRUE(*client_) << client_->error();
  const Identity& viewer = (**server_)->peer();
  EXPECT_EQ(viewer.subject, "CN=viewer");
  EXPECT_EQ(viewer.role, "viewer");
  EXPECT_FALSE(viewer.serial.empty());
  EXPECT_EQ((**client_)->peer().subject, "CN=localhost");
  const Bytes sent = {1, 2, 3};
  EXPECT_EQ((**client_)->Write(sent).count, 3U);
  Bytes space(2);
  EXPECT_EQ((**server_)->Read(space).count, 2U);
  EXPECT_TRUE((**server_)->HasPending()) << "the third byte is in memory, not at the socket";
  EXPECT_EQ((**server_)->Read(space).count, 1U);
  EXPECT_FALSE((**server_)->HasPending());
  EXPECT_EQ((**server_)->Read(space).error, asio::error::would_block);
  (**client_)->End();
  EXPECT_EQ((**server_)->Read(space).error, asio::error::eof);
}

TEST_F(TlsTest, ACertificateWithoutRoleHasNone) {
  Shake(Files("gateway"), Files("plain"));
  ASSERT_TRUE(*server_) << server_->error();
  EXPECT_EQ((**server_)->peer().role, "");
  EXPECT_EQ((**server_)->peer().trouble, "");
}

TEST_F(TlsTest, AServerThatAsksForNoCertificateKnowsNobody) {
  config::TlsFiles server = Files("gateway");
  server.authorities.clear();
  Shake(server, Files(""));
  ASSERT_TRUE(*server_) << server_->error();
  EXPECT_EQ((**server_)->peer().Name(), "");
}

TEST_F(TlsTest, ClientsWithoutATrustedCertificateAreRefused) {
  Shake(Files("gateway"), Files(""));
  EXPECT_THAT(WhyRefused(), HasSubstr("it has sent no certificate"));
  Shake(Files("gateway"),
        {folder_.In("other/viewer.pem"), folder_.In("other/viewer.key"), folder_.In("ca.pem")});
  EXPECT_THAT(WhyRefused(), HasSubstr("its certificate is not valid"));
}

TEST_F(TlsTest, CertificatesOutOfTheirTimeAreRefused) {
  const WallTime now = ReadClocks().wall;
  const pki::Issued authority{pki::testing::ReadText(folder_.In("ca.pem")),
                              pki::testing::ReadText(folder_.In("ca.key"))};
  for (const pki::Validity& validity :
       {pki::Validity{now - 48h, now - 24h}, pki::Validity{now + 24h, now + 48h}}) {
    const auto issued = pki::IssueClient(authority, "late", "viewer", validity);
    ASSERT_TRUE(issued);
    for (const auto& [file, text] :
         {std::pair("late.pem", issued->certificate), std::pair("late.key", issued->key)}) {
      pki::testing::WriteText(folder_.In(file), text);
      std::filesystem::permissions(folder_.In(file), std::filesystem::perms::owner_all);
    }
    Shake(Files("gateway"), Files("late"));
    EXPECT_THAT(WhyRefused(), HasSubstr("its certificate is not valid: certificate"));
  }
}

TEST_F(TlsTest, AServerMustHaveTheNameThatWasCalledAndItsAuthority) {
  Shake(Files("gateway"), Files("viewer"), "127.0.0.1");
  EXPECT_TRUE(*client_);
  for (const char* name : {"gate.example.com", "127.0.0.2"}) {
    Shake(Files("gateway"), Files("viewer"), name);
    ASSERT_FALSE(*client_) << name;
    EXPECT_THAT(client_->error(), HasSubstr("does not contain the name '" + std::string(name)));
  }
  Shake(Files("gateway"), Files("viewer", "other/ca.pem"));
  ASSERT_FALSE(*client_);
  EXPECT_THAT(client_->error(), HasSubstr("its certificate is not valid"));
}

/// Passes the bytes of a connection on in pieces.
void PassOn(asio::io_context& io, asio::local::stream_protocol::socket& from,
            asio::local::stream_protocol::socket& to, std::size_t piece) {
  const auto bytes = std::make_shared<Bytes>(piece);
  from.async_read_some(
      asio::buffer(*bytes),
      [&io, &from, &to, bytes, piece](const asio::error_code& failed, std::size_t count) {
        if (failed) return;
        asio::error_code ignored;
        asio::write(to, asio::buffer(*bytes, count), ignored);
        PassOn(io, from, to, piece);
      });
}

TEST_F(TlsTest, AHandshakeMayArriveInPiecesOfAnySize) {
  for (std::size_t piece = 1; piece < 700; piece = piece < 40 ? piece + 1 : piece + 53) {
    using Socket = asio::local::stream_protocol::socket;
    Socket middle[2] = {Socket(io_), Socket(io_)};
    int ends[2];
    for (int i = 0; i < 2; ++i) {
      int pair[2];
      ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
      ends[i] = pair[0];
      middle[i].assign(asio::local::stream_protocol(), pair[1]);
    }
    PassOn(io_, middle[0], middle[1], piece);
    PassOn(io_, middle[1], middle[0], piece);
    Shake(ends[0], ends[1], Files("gateway"), Files("viewer"));
    ASSERT_TRUE(*server_) << piece << ": " << server_->error();
    ASSERT_TRUE(*client_) << piece << ": " << client_->error();
    const Bytes sent(300, 7);
    EXPECT_EQ((**client_)->Write(sent).count, sent.size());
    Bytes received;
    while (received.size() < sent.size()) {
      io_.restart();
      io_.poll_one();
      Bytes space(512);
      const auto moved = (**server_)->Read(space);
      ASSERT_TRUE(!moved.error || moved.error == asio::error::would_block) << piece;
      Append(received, View(space).first(moved.count));
    }
    EXPECT_EQ(received, sent);
    for (Socket& one : middle) one.close();
    io_.restart();
    io_.run();
  }
}

TEST_F(TlsTest, ADamagedByteEndsTheConnection) {
  Shake(Files("gateway"), Files("viewer"));
  ASSERT_TRUE(*server_ && *client_);
  // The record is written past the channel of the client.
  const int socket = (**client_)->Release();
  const Bytes record = {0x17, 3,  3,  0,  20, 1,  2,  3,  4,  5,  6,  7, 8,
                        9,    10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20};
  ASSERT_EQ(::write(socket, record.data(), record.size()), static_cast<ssize_t>(record.size()));
  Bytes space(100);
  EXPECT_EQ((**server_)->Read(space).error, std::errc::protocol_error);
  ::close(socket);
}

TEST_F(TlsTest, AClientThatSpeaksNoTlsIsRefused) {
  int pair[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
  const Bytes request = {0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1};
  ASSERT_EQ(::write(pair[1], request.data(), request.size()), 12);
  const auto ticket =
      handshakes_.Begin(pair[0], Made(End::server, Files("gateway")), "10.0.0.7:4000", io_,
                        [this](ChannelResult result) { server_ = std::move(result); });
  const auto guard = asio::make_work_guard(io_);
  while (!server_) io_.run_one();
  EXPECT_EQ(WhyRefused(), "it does not speak TLS");
  char byte = 0;
  while (::read(pair[1], &byte, 1) > 0) continue;  // the alert, then the end
  ::close(pair[1]);
}

TEST_F(TlsTest, SilentClientsOfOneHostLeavePlacesForOthers) {
  std::vector<Handshakes::Ticket> tickets;
  std::vector<int> clients;
  std::size_t refused = 0;
  const auto context = Made(End::server, Files("gateway"));
  for (std::size_t i = 0; i < Handshakes::kMost; ++i) {
    int pair[2];
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
    clients.push_back(pair[1]);
    tickets.push_back(handshakes_.Begin(pair[0], context, "10.0.0.66:" + std::to_string(i), io_,
                                        [&refused](ChannelResult result) {
                                          EXPECT_THAT(result.error(), HasSubstr("unfinished"));
                                          ++refused;
                                        }));
  }
  const auto guard = asio::make_work_guard(io_);
  while (refused < Handshakes::kMost / 2) io_.run_one();
  Shake(Files("gateway"), Files("viewer"));
  EXPECT_TRUE(*server_) << "another host";
  EXPECT_EQ(refused, Handshakes::kMost / 2);
  tickets.clear();
  for (const int client : clients) {
    char byte = 0;
    EXPECT_EQ(::read(client, &byte, 1), 0) << "closed with its ticket";
    ::close(client);
  }
}

TEST_F(TlsTest, ATicketThatIsGivenUpCallsNothing) {
  int pair[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
  {
    const auto ticket = handshakes_.Begin(pair[0], Made(End::server, Files("gateway")), "a", io_,
                                          [](ChannelResult) { FAIL(); });
  }
  char byte = 0;
  EXPECT_EQ(::read(pair[1], &byte, 1), 0);
  ::close(pair[1]);
  io_.poll();
}

// A pipe stands for a disk that does not answer.
TEST_F(TlsTest, FilesThatCannotBeReadNowDelayOnlyTheHandshake) {
  const std::string authority = folder_.In("slow.pem");
  ASSERT_EQ(::mkfifo(authority.c_str(), 0600), 0);
  int pair[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
  const auto ticket =
      handshakes_.Begin(pair[0], Made(End::server, Files("gateway", "slow.pem")), "10.0.0.7:4000",
                        io_, [this](ChannelResult result) { server_ = std::move(result); });
  io_.poll();
  EXPECT_FALSE(server_) << "the caller goes on while the file is read";
  std::ofstream(authority) << "no certificate";
  const auto guard = asio::make_work_guard(io_);
  io_.restart();
  while (!server_) io_.run_one();
  EXPECT_THAT(WhyRefused(), HasSubstr("slow.pem contains no certificate"));
  ::close(pair[1]);
}

TEST_F(TlsTest, ChangedFilesAreUsedAndWrongOnesAreNot) {
  ContextFiles files(End::server, Files("gateway"));
  const auto first = files.Current();
  ASSERT_TRUE(first) << first.error();
  EXPECT_EQ(*files.Current(), *first);
  Write("");
  const auto second = files.Current();
  ASSERT_TRUE(second);
  EXPECT_NE(*second, *first);
  std::filesystem::copy_file(folder_.In("other/gateway.key"), folder_.In("gateway.key"),
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(*files.Current(), *second) << "the key of another certificate";
  std::filesystem::remove(folder_.In("gateway.pem"));
  EXPECT_EQ(*files.Current(), *second);
  Write("");
  EXPECT_NE(*files.Current(), *second);
  ContextFiles absent(End::server, Files("absent"));
  EXPECT_THAT(absent.Current().error(), HasSubstr("absent.pem cannot be read"));
}

/// Makes a certificate for `name` with a new key; `issuer` null: it signs itself.
pki::Issued MakeLink(const std::string& name, bool authority, const pki::Issued* issuer) {
  const PrivateKey key(EVP_EC_gen("prime256v1"));
  const Certificate made(X509_new());
  const auto add = [&](int kind, const char* value) {
    X509V3_CTX context;
    X509V3_set_ctx(&context, made.get(), made.get(), nullptr, nullptr, 0);
    X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value);
    X509_add_ext(made.get(), extension, -1);
    X509_EXTENSION_free(extension);
  };
  X509_set_version(made.get(), X509_VERSION_3);
  ASN1_INTEGER_set(X509_get_serialNumber(made.get()), 7);
  X509_gmtime_adj(X509_getm_notBefore(made.get()), -3600);
  X509_gmtime_adj(X509_getm_notAfter(made.get()), 3600);
  X509_set_pubkey(made.get(), key.get());
  X509_NAME_add_entry_by_txt(X509_get_subject_name(made.get()), "CN", MBSTRING_UTF8,
                             reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1, 0);
  auto parents = issuer ? ParseCertificates(issuer->certificate) : std::vector<Certificate>();
  X509_set_issuer_name(made.get(),
                       X509_get_subject_name(issuer ? parents.front().get() : made.get()));
  add(NID_basic_constraints, authority ? "critical,CA:TRUE" : "critical,CA:FALSE");
  if (!authority) add(NID_subject_alt_name, "DNS:localhost");
  const PrivateKey signer = issuer ? ParseKey(issuer->key, {}) : nullptr;
  X509_sign(made.get(), signer ? signer.get() : key.get(), EVP_sha256());
  const Bio certificate(BIO_new(BIO_s_mem()));
  const Bio secret(BIO_new(BIO_s_mem()));
  PEM_write_bio_X509(certificate.get(), made.get());
  PEM_write_bio_PKCS8PrivateKey(secret.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  return {Written(certificate), Written(secret)};
}

TEST_F(TlsTest, TheChainIsSentAndAccepted) {
  const pki::Issued root = MakeLink("root", true, nullptr);
  const pki::Issued middle = MakeLink("middle", true, &root);
  for (const bool whole : {true, false}) {
    for (const char* name : {"server", "client"}) {
      const pki::Issued leaf = MakeLink(name, false, &middle);
      pki::testing::WriteText(folder_.In(name + std::string(".pem")),
                              leaf.certificate + (whole ? middle.certificate : ""));
      pki::testing::WriteText(folder_.In(name + std::string(".key")), leaf.key);
      std::filesystem::permissions(folder_.In(name + std::string(".key")),
                                   std::filesystem::perms::owner_all);
    }
    pki::testing::WriteText(folder_.In("root.pem"), root.certificate);
    Shake(Files("server", "root.pem"), Files("client", "root.pem"));
    EXPECT_EQ(server_->ok(), whole);
    EXPECT_EQ(client_->ok(), whole);
  }
  // The file of the authorities has the intermediate authority only.
  pki::testing::WriteText(folder_.In("middle.pem"), middle.certificate);
  Shake(Files("server", "middle.pem"), Files("client", "middle.pem"));
  EXPECT_TRUE(server_->ok());
  EXPECT_TRUE(client_->ok());
}

TEST_F(TlsTest, TheEndOfTheFirstCertificateCounts) {
  const auto texts = ReadTls(Files("gateway"));
  ASSERT_TRUE(texts);
  EXPECT_EQ(texts->ends_first, folder_.In("gateway.pem"));
  EXPECT_EQ(EndsSoon(*texts, texts->until - 31 * 24h), "");
  EXPECT_THAT(EndsSoon(*texts, texts->until - 29 * 24h), HasSubstr("gateway.pem ends on"));
  EXPECT_THAT(EndsSoon(*texts, texts->until), HasSubstr("has ended on"));
}

/// Counts the callbacks of a transport.
struct Heard final : transports::TransportListener {
  void OnOpened() override { opened = true; }
  void OnOpenFailed(const std::string& reason) override { failed = reason; }
  void OnBytes(View bytes) override { Append(received, bytes); }
  void OnLost(const std::string& reason) override { failed = reason; }
  void OnStuck(const std::string& reason) override { stuck = reason; }
  bool opened = false;
  std::string failed;
  std::string stuck;
  Bytes received;
};

/// A line at a serial server with TLS.
class TlsLineTest : public TlsTest {
 protected:
  void Open(const std::string& authority = "ca.pem") {
    line_ = transports::MakeTcpClient(
        "tls://localhost:" + std::to_string(acceptor_.local_endpoint().port()), {},
        Files("viewer", authority), io_, heard_);
    acceptor_.async_accept([this](const asio::error_code& failed, asio::ip::tcp::socket socket) {
      if (failed) return;
      ticket_ = handshakes_.Begin(socket.release(), Made(End::server, Files("gateway")), "a", io_,
                                  [this](ChannelResult result) { server_ = std::move(result); });
    });
    line_->Open();
    RunUntil([this] { return (heard_.opened && server_) || !heard_.failed.empty(); });
  }
  void RunUntil(const std::function<bool()>& done) {
    const auto guard = asio::make_work_guard(io_);
    io_.restart();
    while (!done()) io_.run_one();
  }

  asio::ip::tcp::acceptor acceptor_{io_, {asio::ip::address_v4::loopback(), 0}};
  Handshakes::Ticket ticket_;
  Heard heard_;
  std::unique_ptr<transports::Transport> line_;
};

TEST_F(TlsLineTest, BytesPassBothWays) {
  Open();
  ASSERT_TRUE(heard_.opened) << heard_.failed;
  ASSERT_TRUE(*server_) << server_->error();
  line_->Send(Bytes{1, 2, 3});
  Bytes space(10);
  Channel::Moved moved;
  RunUntil([&] { return (moved = (**server_)->Read(space)).count > 0; });
  EXPECT_EQ(moved.count, 3U);
  (**server_)->Write(Bytes(9000, 5));
  RunUntil([&] { return heard_.received.size() == 9000; });
  (**server_)->End();
  RunUntil([&] { return !heard_.failed.empty(); });
  EXPECT_THAT(heard_.failed, HasSubstr("closed the connection"));
}

TEST_F(TlsLineTest, AServerOfAnotherAuthorityIsNotUsed) {
  Open("other/ca.pem");
  EXPECT_FALSE(heard_.opened);
  EXPECT_THAT(heard_.failed, HasSubstr("its certificate is not valid"));
}

TEST_F(TlsLineTest, AfterARequestThatWasGivenUpTheConnectionEnds) {
  Open();
  ASSERT_TRUE(heard_.opened) << heard_.failed;
  // The server reads nothing, so at some time a record is sent in part only.
  Bytes request(4000, 7);
  while (line_->Unsent() == 0) line_->Send(request);
  line_->DropUnsent();
  line_->Send(Bytes{'n', 'e', 'x', 't'});
  RunUntil([&] { return !heard_.stuck.empty(); });
  EXPECT_FALSE(line_->is_open());
  Bytes space(16384);
  for (Channel::Moved moved = (**server_)->Read(space); moved.count > 0;
       moved = (**server_)->Read(space)) {
    for (std::size_t i = 0; i < moved.count; ++i) ASSERT_EQ(space[i], 7);
  }
}

}  // namespace
}  // namespace baudgate::tls
