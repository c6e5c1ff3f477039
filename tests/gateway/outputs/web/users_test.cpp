// Tests of users over HTTP: login by password, roles, writes, sessions, the security journal, TLS.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <openssl/ssl.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "gateway/outputs/control/request_handler.h"
#include "gateway/outputs/pki/server_files.h"
#include "gateway/records/audit/security_journal.h"
#include "tests/gateway/outputs/web/fixture.h"
#include "transports/tls_files.h"

namespace baudgate::web {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class WebUsersTest : public WebTest {
 protected:
  WebUsersTest() {
    std::string form = (fs::temp_directory_path() / "baudgate-web-users-XXXXXX").string();
    folder_ = ::mkdtemp(form.data());
    users::UserFile file;
    EXPECT_TRUE(file.Set("anna", Role::operating, "correct horse"));
    EXPECT_TRUE(file.Set("vera", Role::viewer, "correct horse"));
    EXPECT_TRUE(file.Set("otto", Role::engineer, "correct horse"));
    EXPECT_TRUE(file.Set("rita", Role::auditor, "correct horse"));
    for (const char* name : {"anna", "vera", "otto", "rita"}) {
      tokens_[name] = file.AddToken(name, ReadClocks().wall + 1h).value();
    }
    std::ofstream(folder_ / "users") << file.Text();
    ::chmod((folder_ / "users").c_str(), 0640);
    config_.users.file = (folder_ / "users").string();
    config::Point& current = config_.lines[0].devices[0].points[0];
    current.access = config::Access::read_write;
    current.writing.allowed = true;
    journal_ = std::make_unique<audit::SecurityJournal>(folder_);
    info_.journal = journal_.get();
    commands_ = &lines_;
  }
  ~WebUsersTest() override {
    Stop();
    journal_.reset();
    fs::remove_all(folder_);
  }

  std::string As(const std::string& name) const {
    return "Authorization: Bearer " + tokens_.at(name) + "\r\n";
  }
  std::vector<std::string> Journal() {
    EXPECT_TRUE(journal_->Flush(20s));
    std::vector<std::string> rows;
    const auto check = audit::VerifyJournal(folder_);
    for (const audit::JournalRow& row : check.value().rows) {
      rows.push_back(row.event.kind + " " + row.event.who + " " + row.event.what + " " +
                     row.event.result);
      if (row.event.from != "127.0.0.1") others_.push_back(rows.back());
    }
    return rows;
  }

  std::vector<std::string> others_;  // rows of Journal that come from another host
  fs::path folder_;
  std::map<std::string, std::string> tokens_;
  std::unique_ptr<audit::SecurityJournal> journal_;
};

constexpr const char* kWrite = R"({"point":"bay-1.feeder-1.current","value":2})";

TEST_F(WebUsersTest, AUserLogsInWithAPassword) {
  Start();
  EXPECT_EQ(Get("/api/v1/status").status, 401);
  EXPECT_EQ(Client().Post("/login", R"({"user":"anna","password":"wrong horse"})").status, 401);
  Reply login = Client().Post("/login", R"({"user":"anna","password":"correct horse"})");
  ASSERT_EQ(login.status, 204);
  const std::string cookie = login.headers["set-cookie"];
  const std::string shown = "Cookie: " + cookie.substr(0, cookie.find(';')) + "\r\n";
  const auto session = nlohmann::json::parse(Get("/api/v1/session", shown).body);
  EXPECT_EQ(session["user"], "anna");
  EXPECT_EQ(session["role"], "operator");
  EXPECT_EQ(session["write"], true);
  EXPECT_EQ(Get("/api/v1/status", shown).status, 200);
  EXPECT_EQ(Client().Post("/logout", "", shown).status, 204);
  EXPECT_EQ(Get("/api/v1/status", shown).status, 401);
  EXPECT_THAT(Journal(),
              ::testing::ElementsAre(HasSubstr("host  first connection at web 127.0.0.1"),
                                     "login anna page wrong user or password", "login anna page ok",
                                     "logout anna page ok"));
}

TEST_F(WebUsersTest, TheFirstConnectionOfEachHostIsInTheJournal) {
  config_.web.allow = {*config::ParseNetwork("127.0.0.0/8"), *config::ParseNetwork("10.0.0.0/8")};
  Access access(8502, "1", nullptr, journal_.get());
  access.Set(config_, std::nullopt);
  const auto come = [&](const std::string& peer) {
    Request request;
    request.method = "GET";
    request.path = "/";
    request.peer = peer;
    request.local = "10.0.0.1";
    request.headers["host"] = "10.0.0.1:8502";
    access.Refuse(request, ReadClocks());
  };
  for (const char* peer : {"10.0.0.7", "10.0.0.7", "10.0.0.8", "192.0.2.1", "10.0.0.7"}) come(peer);
  EXPECT_TRUE(journal_->Flush(20s));
  std::vector<std::string> hosts;
  const auto check = audit::VerifyJournal(folder_);
  for (const audit::JournalRow& row : check.value().rows) {
    if (row.event.kind == "host") hosts.push_back(row.event.from);
  }
  EXPECT_THAT(hosts, ::testing::ElementsAre("10.0.0.7", "10.0.0.8"))
      << "web.allow refuses the other";
}

TEST_F(WebUsersTest, OnlyARoleThatMayWritesAPoint) {
  Start();
  const auto write = [this](const std::string& who) {
    return Client().Post("/api/v1/write", kWrite, who);
  };
  EXPECT_EQ(write("").status, 401);
  const Reply viewer = write(As("vera"));
  EXPECT_EQ(viewer.status, 403);
  EXPECT_THAT(viewer.body, HasSubstr("needs the role operator"));
  const Reply done = write(As("anna"));
  EXPECT_EQ(done.status, 200);
  EXPECT_THAT(done.body, HasSubstr("\"end\":\"ok\""));
  EXPECT_EQ(write(As("otto")).status, 200);
  EXPECT_EQ(write(As("anna") + "X-Forwarded-For: 10.0.0.9\r\n").status, 403)
      << "not private: it came through a proxy without TLS";
  EXPECT_EQ(Client()
                .Post("/api/v1/write", R"({"point":"bay-1.feeder-1.none","value":2})", As("anna"))
                .status,
            404);
  for (const char* wrong : {"{}", R"({"point":"bay-1.feeder-1.current","value":"abc"})",
                            R"({"point":"bay-1.feeder-1.current","value":2,"value":3})",
                            R"({"point":"bay-1.feeder-1.current","value":2,"confirm":"yes"})"}) {
    EXPECT_EQ(Client().Post("/api/v1/write", wrong, As("anna")).status, 400) << wrong;
  }
}

TEST_F(WebUsersTest, OperationsNeedTheirRoleAndAreInTheJournal) {
  Start();
  struct Row {
    const char* path;
    const char* body;
    int anna;  ///< status for the operator
    int otto;  ///< status for the engineer
  };
  const Row rows[] = {
      {"/api/v1/devices/disable", R"({"device":"bay-1.feeder-1"})", 200, 200},
      {"/api/v1/devices/enable", R"({"device":"bay-1.feeder-1"})", 200, 200},
      {"/api/v1/devices/enable", R"({"device":"bay-1.none"})", 404, 404},
      {"/api/v1/devices/enable", R"({"line":"bay-1"})", 400, 400},
      {"/api/v1/lines/release", R"({"line":"bay-1"})", 200, 200},
      {"/api/v1/lines/release", "", 400, 400},
      {"/api/v1/reload/confirm", "{}", 403, 503},
      {"/api/v1/reload/revert", "", 403, 503},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(row.path);
    EXPECT_EQ(Get(row.path, As("otto")).status, 405);
    EXPECT_EQ(Client().Post(row.path, row.body).status, 401);
    EXPECT_EQ(Client().Post(row.path, row.body, As("vera")).status, 403);
    EXPECT_EQ(Client().Post(row.path, row.body, As("anna")).status, row.anna);
    EXPECT_EQ(Client().Post(row.path, row.body, As("otto")).status, row.otto);
    EXPECT_EQ(
        Client().Post(row.path, row.body, As("otto") + "X-Forwarded-For: 10.0.0.9\r\n").status,
        403);
  }
  EXPECT_THAT(lines_.calls(), Contains("do not use 0"));
  EXPECT_THAT(lines_.calls(), Contains("take back 0"));
  const auto journal = Journal();
  EXPECT_THAT(journal, Contains("command anna disable bay-1.feeder-1 ok"));
  EXPECT_THAT(journal, Contains("command otto take_back bay-1 ok"));
  EXPECT_THAT(journal, Contains(HasSubstr("command otto revert")));
  EXPECT_THAT(journal, Contains(HasSubstr("denied vera /api/v1/devices/disable")));
  EXPECT_THAT(journal, Contains(HasSubstr("denied otto /api/v1/devices/disable "
                                          "/api/v1/devices/disable is possible only over TLS")));
  EXPECT_THAT(others_, ::testing::IsEmpty()) << "each row has the address";
}

struct FakeReloads final : control::ReloadService {
  void Reload(const control::ReloadAsk&, Answered answered) override { answered({}); }
  void Confirm(const control::ReloadAsk& ask, Answered answered) override {
    seen = ask;
    answered(answer);
  }
  void Revert(const control::ReloadAsk& ask, Answered answered) override { Confirm(ask, answered); }
  control::ReloadAsk seen;
  control::ReloadAnswer answer;
};

TEST_F(WebUsersTest, ATrialThatIsNotThereIsAConflict) {
  FakeReloads reloads;
  reload_ = &reloads;
  reloads.answer.exit_code = 2;
  Start();
  const Reply none = Client().Post("/api/v1/reload/confirm", "{}", As("otto"));
  EXPECT_EQ(none.status, 409);
  EXPECT_THAT(none.body, HasSubstr("\"ok\":false"));
  const std::string seen = R"({"applied":"2026-12-01T08:00:00.000Z"})";
  EXPECT_EQ(Client().Post("/api/v1/reload/revert", seen, As("otto")).status, 409);
  EXPECT_EQ(reloads.seen.applied, "2026-12-01T08:00:00.000Z");
  EXPECT_EQ(reloads.seen.by, "web:otto@127.0.0.1");
  EXPECT_EQ(Client().Post("/api/v1/reload/revert", R"({"applied":1})", As("otto")).status, 400);
  reloads.answer.exit_code = 4;
  EXPECT_EQ(Client().Post("/api/v1/reload/revert", "", As("otto")).status, 503);
  reloads.answer.ok = true;
  EXPECT_EQ(Client().Post("/api/v1/reload/confirm", "", As("otto")).status, 200);
  Stop();
}

TEST_F(WebUsersTest, ARefusedPageOfAnotherSiteIsInTheJournal) {
  Start();
  EXPECT_EQ(Client().Post("/api/v1/write", kWrite, As("anna") + "Origin: http://evil\r\n").status,
            403);
  EXPECT_THAT(Journal(), Contains(HasSubstr("denied unknown /api/v1/write a page from")));
}

TEST_F(WebUsersTest, NoOperationIsPossibleWithoutUsers) {
  config_.users.file.clear();
  Start();
  for (const Operation& one : kOperations) {
    EXPECT_EQ(Client().Post(std::string(one.path), "{}").status, 403) << one.path;
  }
  EXPECT_EQ(nlohmann::json::parse(Get("/api/v1/session").body)["may"], nlohmann::json::array());
}

TEST_F(WebUsersTest, TheSessionTellsWhatTheUserMay) {
  Start();
  const auto may = [&](const std::string& who, const std::string& more = "") {
    return nlohmann::json::parse(Get("/api/v1/session", As(who) + more).body)["may"].dump();
  };
  EXPECT_EQ(may("vera"), "[]");
  EXPECT_EQ(may("anna"), R"(["acknowledge","write","disable","release"])");
  EXPECT_EQ(may("otto"),
            R"(["acknowledge","write","disable","release","confirm","sessions","end_sessions"])");
  EXPECT_EQ(may("anna", "X-Forwarded-For: 10.0.0.9\r\n"), "[]") << "others could read the request";
}

TEST_F(WebUsersTest, AWriteIsDeniedIfTheValueIsNotTheExpectedOne) {
  Start();
  Put(0, 0, static_cast<double>(5.3F));
  const auto write = [&](const std::string& expect) {
    const std::string body =
        R"({"point":"bay-1.feeder-1.current","value":2,"expect":)" + expect + "}";
    return nlohmann::json::parse(Client().Post("/api/v1/write", body, As("anna")).body);
  };
  EXPECT_EQ(write("5.3")["end"], "ok");
  EXPECT_EQ(write(nlohmann::json(static_cast<double>(5.3F)).dump())["end"], "ok");
  const auto denied = write("5.4");
  EXPECT_EQ(denied["end"], "denied");
  EXPECT_EQ(denied["needs"], "expect");
  EXPECT_EQ(denied["reason"], "'current': the value has changed meanwhile to 5.3");
  EXPECT_EQ(write("null")["end"], "denied");
  EXPECT_EQ(write("[5.3]")["status"], 400);
  EXPECT_EQ(write("5.3,\"expected\":5.3")["status"], 400) << "a member that does not exist";
}

TEST_F(WebUsersTest, AStreamEndsWithItsLogin) {
  Start();
  Reply login = Client().Post("/login", R"({"user":"vera","password":"correct horse"})");
  const std::string cookie = login.headers["set-cookie"];
  const std::string vera = "Cookie: " + cookie.substr(0, cookie.find(';')) + "\r\n";
  HttpClient stream = Client();
  ASSERT_EQ(stream.Open("/api/v1/points/stream", vera).status, 200);
  EXPECT_TRUE(stream.NextEvent());
  EXPECT_EQ(Client().Post("/logout", "", vera).status, 204);
  while (stream.NextEvent()) {
  }
}

TEST_F(WebUsersTest, ARequestWithoutContentTakesAPlaceWhateverItsLength) {
  limits_.connections = 1;
  Start();
  HttpClient first = Client();
  const std::string length = "Content-Length: 00\r\n";
  ASSERT_EQ(first.Open("/api/v1/points/stream", As("vera") + length).status, 200);
  EXPECT_EQ(Get("/api/v1/status", As("vera") + length).status, 503);
}

TEST_F(WebUsersTest, OnlyAuditorsReadTheAuditOfWrites) {
  Start();
  EXPECT_EQ(Get("/api/v1/writes", As("otto")).status, 403);
  EXPECT_EQ(Get("/api/v1/writes").status, 401);
  // This gateway permits no write, so it has no records.
  const Reply records = Get("/api/v1/writes?after=0&since_ms=0", As("rita"));
  EXPECT_EQ(records.status, 503);
  EXPECT_THAT(records.body, HasSubstr("writes"));
  EXPECT_EQ(Get("/api/v1/writes?line=bay-1", As("rita")).status, 400);
  EXPECT_EQ(nlohmann::json::parse(Get("/api/v1/session", As("rita")).body)["may"].dump(),
            R"(["sessions","writes"])");
}

TEST_F(WebUsersTest, AnEngineerListsAndEndsSessions) {
  Start();
  Reply login = Client().Post("/login", R"({"user":"vera","password":"correct horse"})");
  const std::string cookie = login.headers["set-cookie"];
  const std::string vera = "Cookie: " + cookie.substr(0, cookie.find(';')) + "\r\n";
  EXPECT_EQ(Get("/api/v1/sessions", vera).status, 403);
  const auto list = nlohmann::json::parse(Get("/api/v1/sessions", As("otto")).body)["sessions"];
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0]["user"], "vera");
  EXPECT_EQ(list[0]["role"], "viewer");
  const std::string end = R"({"id":")" + list[0]["id"].get<std::string>() + "\"}";
  EXPECT_EQ(Client().Post("/api/v1/sessions/end", end, As("anna")).status, 403);
  EXPECT_EQ(Client().Post("/api/v1/sessions/end", end, As("otto")).status, 204);
  EXPECT_EQ(Client().Post("/api/v1/sessions/end", end, As("otto")).status, 404);
  EXPECT_EQ(Get("/api/v1/status", vera).status, 401);
}

TEST_F(WebUsersTest, CommandsNeedTheirRoleAndAreRecorded) {
  control::RequestHandler handler(config_, store_, lines_, lines_, info_);
  const auto ask = [&](std::optional<Role> role, const char* request) {
    const bus::Writer writer{"user:anna", 1, {}, 0, role};
    return handler.Answer(request, writer, ReadClocks(), [](const std::string&) {}).text;
  };
  constexpr const char* kDisable = R"({"command":"disable","target":"bay-1.feeder-1"})";
  EXPECT_THAT(ask(Role::viewer, kDisable), HasSubstr("\"error\":\"denied\""));
  EXPECT_THAT(ask(Role::operating, kDisable), Not(HasSubstr("error")));
  EXPECT_THAT(ask(Role::operating, R"({"command":"confirm"})"),
              HasSubstr("needs the role engineer"));
  EXPECT_THAT(ask(Role::engineer, R"({"command":"writes"})"), HasSubstr("needs the role auditor"));
  EXPECT_THAT(ask(std::nullopt, R"({"command":"status"})"), Not(HasSubstr("\"error\"")));
  const auto rows = Journal();
  EXPECT_THAT(
      rows,
      Contains(HasSubstr("denied user:anna disable bay-1.feeder-1 user:anna has the role viewer")));
  EXPECT_THAT(rows, Contains("command user:anna disable bay-1.feeder-1 ok"));
  EXPECT_THAT(rows, Not(Contains(HasSubstr("status"))));
}

/// A TLS client that trusts one authority. Empty: the handshake or the request failed.
std::string GetByTls(std::uint16_t port, const fs::path& ca, const std::string& path,
                     int version = TLS1_3_VERSION) {
  const RawClient raw(port);
  SSL_CTX* const context = SSL_CTX_new(TLS_client_method());
  SSL_CTX_load_verify_locations(context, ca.c_str(), nullptr);
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
  SSL_CTX_set_min_proto_version(context, version);
  SSL_CTX_set_max_proto_version(context, version);
  SSL* const ssl = SSL_new(context);
  SSL_set1_host(ssl, "localhost");
  SSL_set_fd(ssl, raw.socket());
  std::string answer;
  if (SSL_connect(ssl) == 1) {
    const std::string request =
        "GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n";
    SSL_write(ssl, request.data(), static_cast<int>(request.size()));
    char bytes[4096];
    for (int got = 0; (got = SSL_read(ssl, bytes, sizeof bytes)) > 0;) {
      answer.append(bytes, static_cast<std::size_t>(got));
    }
  }
  SSL_free(ssl);
  SSL_CTX_free(context);
  return answer;
}

TEST_F(WebUsersTest, ThePageSpeaksTls) {
  const auto made =
      pki::WriteServerFiles(folder_ / "tls", {"localhost", "127.0.0.1"}, {}, ReadClocks().wall);
  ASSERT_TRUE(made) << made.error();
  config_.web.tls.certificate = folder_ / "tls/gateway.pem";
  config_.web.tls.key = folder_ / "tls/gateway.key";
  Start();
  const fs::path ca = folder_ / "tls/ca.pem";
  EXPECT_THAT(GetByTls(port_, ca, "/"), HasSubstr("200 OK"));
  EXPECT_THAT(GetByTls(port_, ca, "/", TLS1_2_VERSION), HasSubstr("200 OK"));
  EXPECT_EQ(GetByTls(port_, ca, "/", TLS1_1_VERSION), "");
  EXPECT_EQ(GetByTls(port_, folder_ / "absent", "/"), "") << "another authority";
  EXPECT_EQ(Get("/").status, 0) << "without TLS";
  // A renewed certificate: the connections end, the port stays.
  ASSERT_TRUE(pki::WriteServerFiles(folder_ / "tls", {"localhost"}, {}, ReadClocks().wall));
  for (int renewal = 0; renewal < 2; ++renewal) {
    const auto renewed = WebServer::Open(config_.web, &config_.web);
    ASSERT_TRUE(renewed) << renewed.error();
    EXPECT_TRUE(server_->Apply(Running(), {{}, {}, renewed->tls}, nullptr));
    EXPECT_THAT(GetByTls(port_, ca, "/"), HasSubstr("200 OK"));
  }
  config_.web.tls.authorities = ca;
  const auto opened = WebServer::Open(config_.web, &config_.web);
  ASSERT_TRUE(opened) << opened.error();
  EXPECT_FALSE(opened->socket.is_open());
  EXPECT_TRUE(server_->Apply(Running(), {{}, {}, opened->tls}, nullptr));
  EXPECT_THAT(GetByTls(port_, ca, "/"), HasSubstr("403 Forbidden")) << "without a certificate";
}

TEST_F(WebUsersTest, FilesOfTlsAreCheckedBeforeTheyAreUsed) {
  ASSERT_TRUE(pki::WriteServerFiles(folder_ / "a", {"localhost"}, {}, ReadClocks().wall));
  ASSERT_TRUE(pki::WriteServerFiles(folder_ / "b", {"localhost"}, {}, ReadClocks().wall));
  const fs::path a = folder_ / "a";
  const auto error = [](const fs::path& certificate, const fs::path& key) {
    const auto texts = tls::ReadTls({certificate.string(), key.string(), ""});
    return texts ? std::string() : texts.error();
  };
  EXPECT_EQ(error(a / "gateway.pem", a / "gateway.key"), "");
  EXPECT_THAT(error(a / "gateway.pem", folder_ / "b/gateway.key"), HasSubstr("does not belong"));
  EXPECT_THAT(error(a / "gateway.key", a / "gateway.key"), HasSubstr("no certificate"));
  EXPECT_THAT(error(a / "gateway.pem", a / "gateway.pem"), HasSubstr("by every user"));
  EXPECT_THAT(error(a / "absent", a / "gateway.key"), HasSubstr("absent cannot be read"));
  ::chmod((a / "gateway.key").c_str(), 0644);
  EXPECT_THAT(error(a / "gateway.pem", a / "gateway.key"), HasSubstr("chmod o= "));
  EXPECT_THAT(tls::NamesIn((folder_ / "b/gateway.pem").string()),
              ::testing::ElementsAre("localhost"));
  const auto made = [&](const std::vector<std::string>& names) {
    const auto files = pki::WriteServerFiles(a.string(), names, {}, ReadClocks().wall);
    return files ? std::string() : files.error();
  };
  EXPECT_EQ(made({"*.example.com", "10.0.0.7", "2001:db8::1"}), "");
  for (const char* name : {"http://g:1", "10.0.0.300", "a,b", ""}) {
    EXPECT_THAT(made({name}), HasSubstr("is not a host name or an address")) << name;
  }
  fs::rename(a / "ca.key", a / "ca.key.apart");
  EXPECT_THAT(made({"localhost"}), HasSubstr("ca.key is missing"));
  fs::copy_file(folder_ / "b/ca.key", a / "ca.key");
  EXPECT_THAT(made({"localhost"}), HasSubstr("does not belong to"));
  const WallTime now = ReadClocks().wall;
  const auto soon = [now](Duration left) {
    return tls::EndsSoon({.until = now + left, .ends_first = "f"}, now);
  };
  EXPECT_EQ(soon(31 * 24h), "");
  EXPECT_THAT(soon(29 * 24h), HasSubstr("the certificate f ends on"));
  EXPECT_THAT(soon({}), HasSubstr("has ended"));
}

}  // namespace
}  // namespace baudgate::web
