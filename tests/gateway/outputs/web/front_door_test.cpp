// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "gateway/outputs/web/access.h"

namespace baudgate::web {
namespace {

config::Web WebOf(const std::string& allow = "") {
  config::Web web;
  web.hosts = {"gate.example", "proxy.example:8443"};
  if (!allow.empty()) web.allow.push_back(*config::ParseNetwork(allow));
  return web;
}

Request Asked(const std::map<std::string, std::string>& headers,
              const std::string& peer = "127.0.0.1", const std::string& path = "/api/v1/status") {
  Request request;
  request.method = "GET";
  request.path = path;
  request.headers = headers;
  request.peer = peer;
  request.local = peer == "127.0.0.1" ? peer : "10.0.0.9";
  return request;
}

int StatusOf(const config::Web& web, const Request& request) {
  const auto refused = Refusal(web, request);
  return refused ? refused->status : 200;
}

TEST(FrontDoor, AcceptsOnlyTheNamesOfTheGateway) {
  const struct {
    std::string host;
    std::string peer;
    int status;
  } kHosts[] = {
      {"127.0.0.1:8502", "127.0.0.1", 200},
      {"localhost:8502", "127.0.0.1", 200},
      {"LOCALHOST", "127.0.0.1", 200},
      {"localhost", "10.0.0.7", 421},
      {"gate.example", "10.0.0.7", 200},
      {"GATE.example:9999", "10.0.0.7", 200},
      {"proxy.example:8443", "10.0.0.7", 200},
      {"proxy.example", "10.0.0.7", 421},
      {"evil.example", "127.0.0.1", 421},
      {"gate.example.evil.example", "10.0.0.7", 421},
      {"10.0.0.9:8502", "10.0.0.7", 200},
      {"10.0.0.8:8502", "10.0.0.7", 421},
      {"", "127.0.0.1", 421},
      {"127.0.0.1.evil.example", "127.0.0.1", 421},
      {"[::1]:8502", "127.0.0.1", 421},
      {"gate.example, evil.example", "10.0.0.7", 421},
  };
  for (const auto& [host, peer, status] : kHosts) {
    EXPECT_EQ(StatusOf(WebOf(), Asked({{"host", host}}, peer)), status) << host << " " << peer;
  }
  EXPECT_EQ(StatusOf(WebOf(), Asked({})), 421);
}

TEST(FrontDoor, RefusesRequestsOfOtherPages) {
  const struct {
    std::map<std::string, std::string> headers;
    int status;
  } kPages[] = {
      {{{"origin", "http://gate.example"}}, 200},
      {{{"origin", "https://GATE.example"}}, 200},
      {{{"origin", "http://gate.example:3000"}}, 403},
      {{{"origin", "http://evil.example"}}, 403},
      {{{"origin", "null"}}, 403},
      {{{"origin", "gate.example"}}, 403},
      {{{"sec-fetch-site", "same-origin"}}, 200},
      {{{"sec-fetch-site", "none"}}, 200},
      {{{"sec-fetch-site", "same-site"}}, 403},
      {{{"sec-fetch-site", "cross-site"}}, 403},
      {{{"sec-fetch-site", "cross-site"},
        {"sec-fetch-mode", "navigate"},
        {"sec-fetch-dest", "document"}},
       403},
  };
  for (auto [headers, status] : kPages) {
    headers["host"] = "gate.example";
    EXPECT_EQ(StatusOf(WebOf(), Asked(headers)), status) << headers.begin()->second;
  }
  Request link = Asked({{"host", "gate.example"},
                        {"sec-fetch-site", "cross-site"},
                        {"sec-fetch-mode", "navigate"},
                        {"sec-fetch-dest", "document"}},
                       "10.0.0.7", "/");
  EXPECT_EQ(StatusOf(WebOf(), link), 200) << "a link to the page";
  link.headers["sec-fetch-dest"] = "iframe";
  EXPECT_EQ(StatusOf(WebOf(), link), 403);
}

TEST(FrontDoor, AcceptsOnlyAllowedAddresses) {
  const std::map<std::string, std::string> host = {{"host", "gate.example"}};
  EXPECT_EQ(StatusOf(WebOf("10.0.0.0/8"), Asked(host, "10.1.2.3")), 200);
  EXPECT_EQ(StatusOf(WebOf("10.0.0.0/8"), Asked(host, "192.0.2.1")), 403);
  EXPECT_EQ(StatusOf(WebOf("10.0.0.0/8"), Asked(host, "")), 403);
  EXPECT_EQ(StatusOf(WebOf(), Asked(host, "192.0.2.1")), 200);
}

TEST(FrontDoor, AcknowledgementsNeedAPrivateConnection) {
  config::Web web = WebOf("10.0.0.0/8");
  const std::map<std::string, std::string> tls = {{"x-forwarded-proto", "https"}};
  EXPECT_FALSE(MayAcknowledge(web, Asked({}))) << "not configured";
  web.acknowledge = true;
  EXPECT_TRUE(MayAcknowledge(web, Asked({})));
  EXPECT_TRUE(MayAcknowledge(web, Asked(tls)));
  EXPECT_FALSE(MayAcknowledge(web, Asked(tls, "10.0.0.5"))) << "anybody could say so";
  web.proxies = {config::ReachOf("10.0.0.5")};
  EXPECT_TRUE(MayAcknowledge(web, Asked(tls, "10.0.0.5")));
  EXPECT_FALSE(MayAcknowledge(web, Asked({}, "10.0.0.5"))) << "in the clear";
  EXPECT_FALSE(MayAcknowledge(web, Asked({{"x-forwarded-proto", "http"}})));
  EXPECT_FALSE(MayAcknowledge(web, Asked({{"x-forwarded-for", "10.0.0.5"}})));
}

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using Verdict = Logins::Verdict;

constexpr const char* kRight = "0123456789abcdef";
constexpr Instant kFirst{1h};

Request From(const std::string& peer, const std::string& header = "",
             const std::string& value = "") {
  Request request;
  request.peer = peer;
  if (!header.empty()) request.headers[header] = value;
  return request;
}

Request WithCookie(const std::string& set_cookie) {
  return From("10.0.0.7", "cookie", "other=1; " + set_cookie.substr(0, set_cookie.find(';')));
}

Now At(Duration after) { return {kFirst + after, WallTime(after)}; }

class LoginsTest : public ::testing::Test {
 protected:
  LoginsTest() { logins_.SetToken(kRight); }
  Verdict Check(const Request& request, Duration after = {}) {
    return logins_.Check(request, At(after)).verdict;
  }
  Logins logins_{8502};
};

TEST_F(LoginsTest, WithoutATokenEveryClientIsLoggedIn) {
  EXPECT_EQ(Check(From("10.0.0.7")), Verdict::no);
  logins_.SetToken(std::nullopt);
  EXPECT_EQ(Check(From("10.0.0.7")), Verdict::yes);
  EXPECT_FALSE(logins_.NeedsLogin());
}

TEST_F(LoginsTest, ASessionLastsTwelveHours) {
  const auto opened = logins_.Open(From("10.0.0.7"), kRight, false, At({}));
  EXPECT_EQ(opened.verdict, Verdict::yes);
  EXPECT_THAT(opened.cookie, StartsWith("baudgate-8502="));
  EXPECT_THAT(opened.cookie, HasSubstr("; HttpOnly; SameSite=Strict; Max-Age=43200"));
  EXPECT_THAT(opened.cookie, Not(HasSubstr("Secure")));
  EXPECT_THAT(opened.cookie, Not(HasSubstr("Path="))) << "below a path of a proxy it stays there";
  EXPECT_THAT(opened.cookie, Not(HasSubstr(kRight)));
  const Request later = WithCookie(opened.cookie);
  for (Duration used = 29min; used < 12h; used += 29min) {
    EXPECT_EQ(Check(later, used), Verdict::yes);
  }
  EXPECT_EQ(Check(later, 12h - 1s), Verdict::yes);
  EXPECT_EQ(Check(later, 12h), Verdict::no);
  EXPECT_EQ(Check(From("10.0.0.7", "cookie", "baudgate-8502=abc")), Verdict::no);
  EXPECT_THAT(logins_.Open(From("10.0.0.7"), kRight, true, At({})).cookie, HasSubstr("; Secure"));
}

TEST_F(LoginsTest, ASessionEndsAfterHalfAnHourWithoutARequest) {
  const Request one = WithCookie(logins_.Open(From("10.0.0.7"), kRight, false, At({})).cookie);
  EXPECT_EQ(logins_.Check(one, At(29min), false).verdict, Verdict::yes) << "does not count";
  EXPECT_EQ(Check(one, 30min), Verdict::no);
}

TEST_F(LoginsTest, SessionsAreListedAndCanBeEnded) {
  const Request one = WithCookie(logins_.Open(From("10.0.0.7"), kRight, false, At({})).cookie);
  const auto shown = logins_.Sessions(At(1min));
  ASSERT_EQ(shown.size(), 1U);
  EXPECT_EQ(shown[0].from, "10.0.0.7");
  EXPECT_THAT(one.headers.at("cookie"), Not(HasSubstr(shown[0].id)));
  EXPECT_FALSE(logins_.End("other"));
  EXPECT_TRUE(logins_.End(shown[0].id));
  EXPECT_EQ(Check(one, 1min), Verdict::no);
  EXPECT_TRUE(logins_.Sessions(At(1min)).empty());
}

TEST_F(LoginsTest, OneUserDoesNotEndTheSessionsOfOthers) {
  const Request one = WithCookie(logins_.Open(From("10.0.0.7"), kRight, false, At({})).cookie);
  for (std::size_t i = 1; i < Logins::kMostOfUser; ++i) {
    logins_.Open(From("10.0.0.7"), kRight, false, At(1s));
  }
  EXPECT_EQ(Check(one, 2s), Verdict::yes);
  EXPECT_EQ(logins_.Sessions(At(2s)).size(), Logins::kMostOfUser);
  logins_.Open(From("10.0.0.7"), kRight, false, At(3s));
  EXPECT_EQ(logins_.Sessions(At(3s)).size(), Logins::kMostOfUser) << "the longest idle has ended";
}

class UserLoginsTest : public ::testing::Test {
 protected:
  UserLoginsTest() {
    std::string form = (std::filesystem::temp_directory_path() / "baudgate-logins-XXXXXX").string();
    folder_ = ::mkdtemp(form.data());
    users::UserFile file;
    EXPECT_TRUE(file.Set("anna", Role::operating, "correct horse"));
    token_ = file.AddToken("anna", WallTime(24h)).value();
    std::ofstream(folder_ / "users") << file.Text();
    ::chmod((folder_ / "users").c_str(), 0640);
    logins_.users().SetFile((folder_ / "users").string());
  }
  ~UserLoginsTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  std::string token_;
  Logins logins_{8502};
};

TEST_F(UserLoginsTest, AUserLogsInWithAPasswordOrAToken) {
  EXPECT_TRUE(logins_.NeedsLogin());
  const auto opened = logins_.OpenOf(From("10.0.0.7"), "anna", "correct horse", true, At({}));
  ASSERT_EQ(opened.verdict, Verdict::yes);
  const Logins::Who who = logins_.Check(WithCookie(opened.cookie), At(1min));
  EXPECT_EQ(who.user, "anna");
  EXPECT_EQ(who.role, Role::operating);
  const Request bearer = From("10.0.0.8", "authorization", "Bearer " + token_);
  EXPECT_EQ(logins_.Check(bearer, At(23h)).user, "anna");
  EXPECT_EQ(logins_.Check(bearer, At(24h)).verdict, Verdict::no) << "the token has ended";
}

TEST_F(UserLoginsTest, APasswordIsNotCheckedAfterTooManyWrongOnes) {
  const auto open = [this](const char* password) {
    return logins_.OpenOf(From("10.0.0.7"), "anna", password, false, At({})).verdict;
  };
  for (int i = 0; i < 5; ++i) EXPECT_EQ(open("wrong horse"), Verdict::no);
  EXPECT_EQ(open("correct horse"), Verdict::wait) << "it could be guessed";
  EXPECT_EQ(logins_.OpenOf(From("10.0.0.8"), "anna", "correct horse", false, At({})).verdict,
            Verdict::yes);
}

TEST_F(UserLoginsTest, ASessionEndsWhenItsUserIsRemoved) {
  const auto opened = logins_.OpenOf(From("10.0.0.7"), "anna", "correct horse", true, At({}));
  std::filesystem::remove(folder_ / "users");
  logins_.users().SetFile("");
  logins_.users().SetFile((folder_ / "users").string());
  EXPECT_EQ(logins_.Check(WithCookie(opened.cookie), At(1min)).verdict, Verdict::no);
}

TEST_F(LoginsTest, ASessionEndsWithTheLogoutAndWithTheToken) {
  const Request one = WithCookie(logins_.Open(From("10.0.0.7"), kRight, false, At({})).cookie);
  const Request other = WithCookie(logins_.Open(From("10.0.0.7"), kRight, false, At({})).cookie);
  EXPECT_THAT(logins_.Close(one).cookie, HasSubstr("Max-Age=0"));
  EXPECT_EQ(Check(one), Verdict::no);
  EXPECT_EQ(Check(other), Verdict::yes);
  logins_.SetToken(kRight);
  EXPECT_EQ(Check(other), Verdict::yes) << "the same one";
  logins_.SetToken("another-token-of-it");
  EXPECT_EQ(Check(other), Verdict::no);
}

TEST_F(LoginsTest, ProgramsAuthenticateWithTheBearerToken) {
  const struct {
    std::string header;
    Verdict verdict;
  } kHeaders[] = {{std::string("Bearer ") + kRight, Verdict::yes},
                  {std::string("bearer  ") + kRight + " ", Verdict::yes},
                  {"Bearer 0123456789abcdeX", Verdict::no},
                  {"Bearer ", Verdict::no},
                  {std::string("Bearer ") + kRight + kRight, Verdict::no},
                  {std::string("Basic ") + kRight, Verdict::no}};
  for (const auto& [header, verdict] : kHeaders) {
    EXPECT_EQ(Check(From("10.0.0.7", "authorization", header)), verdict) << header;
  }
}

TEST_F(LoginsTest, AHostMayTryFiveWrongTokensAMinuteAndTheRightOneAlways) {
  const auto open = [this](const char* peer, const char* token, Duration after) {
    return logins_.Open(From(peer), token, false, At(after)).verdict;
  };
  for (int i = 0; i < 5; ++i) EXPECT_EQ(open("2001:db8::7", "wrong", i * 1s), Verdict::no);
  EXPECT_EQ(open("2001:db8::8", "wrong", 59s), Verdict::wait) << "of the same network";
  EXPECT_EQ(open("10.0.0.8", "wrong", 59s), Verdict::no);
  EXPECT_EQ(open("2001:db8::7", kRight, 59s), Verdict::yes);
  EXPECT_EQ(Check(From("2001:db8::7", "authorization", std::string("Bearer ") + kRight), 59s),
            Verdict::yes);
  EXPECT_EQ(open("2001:db8::7", "wrong", 60s), Verdict::no);
}

TEST_F(LoginsTest, AllHostsTogetherMayTryAHundredWrongTokensAMinute) {
  std::size_t answered = 0;
  for (std::size_t i = 0; i < 3 * Logins::kMostGuesses; ++i) {
    const std::string peer = "10.0." + std::to_string(i / 256) + "." + std::to_string(i % 256);
    const auto verdict = logins_.Open(From(peer), "wrong", false, At(i * 1ms)).verdict;
    if (verdict == Verdict::no) ++answered;
  }
  EXPECT_EQ(answered, Logins::kMostGuesses);
  EXPECT_EQ(logins_.Open(From("10.0.0.1"), kRight, false, At(4s)).verdict, Verdict::yes);
}

TEST_F(LoginsTest, AClientBehindATrustedProxyIsJudgedByItsOwnAddress) {
  config::Web web;
  web.proxies = {config::ReachOf("10.0.0.5"), config::ReachOf("10.0.0.6")};
  const auto client = [&](const std::string& peer, const std::string& list) {
    return ForwardedFor(web, From(peer, "x-forwarded-for", list));
  };
  EXPECT_EQ(client("10.0.0.5", "192.0.2.9"), "192.0.2.9");
  EXPECT_EQ(client("10.0.0.5", "1.1.1.1, 192.0.2.9, 10.0.0.6"), "192.0.2.9")
      << "an address that the client has written itself does not count";
  EXPECT_EQ(client("10.0.0.7", "192.0.2.9"), "") << "not a trusted proxy";
  EXPECT_EQ(client("127.0.0.1", "192.0.2.9"), "");
  EXPECT_EQ(client("10.0.0.5", "unknown"), "");
  EXPECT_EQ(client("10.0.0.5", "192.0.2.9:4444"), "192.0.2.9");
  EXPECT_EQ(client("10.0.0.5", "[2001:db8::1]:4444"), "2001:db8::1");
  EXPECT_EQ(client("10.0.0.5", ""), "");
  Request request = From("10.0.0.5");
  for (int i = 0; i < 5; ++i) logins_.Open(request, "wrong", false, At({}));
  request.forwarded_for = "192.0.2.9";
  EXPECT_EQ(logins_.Open(request, "wrong", false, At({})).verdict, Verdict::no);
}

TEST(TokenFile, MustBeReadableByItsOwnerOnly) {
  std::string form = (std::filesystem::temp_directory_path() / "baudgate-token-XXXXXX").string();
  ASSERT_NE(::mkdtemp(form.data()), nullptr);
  const std::string file = form + "/token";
  EXPECT_THAT(ReadToken(file).error(), HasSubstr("openssl rand -hex 32"));
  const struct {
    std::string text;
    mode_t mode;
    std::string says;  ///< empty: the file is good
  } kFiles[] = {
      {"0123456789abcdef\n", 0600, ""},
      {"0123456789abcdef\nsecond line", 0400, ""},
      {"0123456789abcdef", 0640, "chmod 0600"},
      {"0123456789abcdef", 0604, "chmod 0600"},
      {"short\n", 0600, "a token of 5 characters"},
      {"", 0600, "1 to 256 characters"},
      {std::string(300, 'a'), 0600, "characters"},
      {"0123456789 abcdef", 0600, "with spaces"},
  };
  for (const auto& [text, mode, says] : kFiles) {
    std::filesystem::remove(file);
    std::ofstream(file) << text;
    ::chmod(file.c_str(), mode);
    const auto token = ReadToken(file);
    if (says.empty()) {
      ASSERT_TRUE(token) << text;
      EXPECT_EQ(*token, "0123456789abcdef");
    } else {
      ASSERT_FALSE(token) << text;
      EXPECT_THAT(token.error(), HasSubstr(says));
    }
  }
  EXPECT_THAT(ReadToken(form).error(), HasSubstr("not a regular file"));
  const std::string credential = std::string(config::kCredentials) + "token";
  ::unsetenv("CREDENTIALS_DIRECTORY");
  EXPECT_THAT(ReadToken(credential).error(), HasSubstr("LoadCredential=token:"));
  ::setenv("CREDENTIALS_DIRECTORY", form.c_str(), 1);
  std::ofstream(file, std::ios::trunc) << "0123456789abcdef";
  ::chmod(file.c_str(), 0440);
  EXPECT_TRUE(ReadToken(credential)) << "an ACL of systemd shows as group rights";
  ::chmod(file.c_str(), 0444);
  EXPECT_FALSE(ReadToken(credential));
  ::unsetenv("CREDENTIALS_DIRECTORY");
  std::filesystem::remove_all(form);
}

}  // namespace
}  // namespace baudgate::web
