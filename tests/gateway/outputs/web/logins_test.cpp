// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/outputs/web/access.h"

namespace baudgate::web {
namespace {

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

class LoginsTest : public ::testing::Test {
 protected:
  LoginsTest() { logins_.SetToken(kRight); }
  Logins logins_{8502};
};

TEST_F(LoginsTest, WithoutATokenEverybodyIsIn) {
  EXPECT_EQ(logins_.Check(From("10.0.0.7"), kFirst), Verdict::no);
  logins_.SetToken(std::nullopt);
  EXPECT_EQ(logins_.Check(From("10.0.0.7"), kFirst), Verdict::yes);
  EXPECT_FALSE(logins_.NeedsToken());
}

TEST_F(LoginsTest, ASessionLastsTwelveHours) {
  const auto opened = logins_.Open(From("10.0.0.7"), kRight, false, kFirst);
  EXPECT_EQ(opened.verdict, Verdict::yes);
  EXPECT_THAT(opened.cookie, StartsWith("baudgate-8502="));
  EXPECT_THAT(opened.cookie, HasSubstr("; HttpOnly; SameSite=Strict; Max-Age=43200"));
  EXPECT_THAT(opened.cookie, Not(HasSubstr("Secure")));
  EXPECT_THAT(opened.cookie, Not(HasSubstr("Path="))) << "below a path of a proxy it stays there";
  EXPECT_THAT(opened.cookie, Not(HasSubstr(kRight)));
  const Request later = WithCookie(opened.cookie);
  EXPECT_EQ(logins_.Check(later, kFirst + 12h - 1s), Verdict::yes);
  EXPECT_EQ(logins_.Check(later, kFirst + 12h), Verdict::no);
  EXPECT_EQ(logins_.Check(From("10.0.0.7", "cookie", "baudgate-8502=abc"), kFirst), Verdict::no);
  EXPECT_THAT(logins_.Open(From("10.0.0.7"), kRight, true, kFirst).cookie, HasSubstr("; Secure"));
}

TEST_F(LoginsTest, ASessionEndsWithTheLogoutAndWithTheToken) {
  const Request one = WithCookie(logins_.Open(From("10.0.0.7"), kRight, false, kFirst).cookie);
  const Request other = WithCookie(logins_.Open(From("10.0.0.7"), kRight, false, kFirst).cookie);
  EXPECT_THAT(logins_.Close(one), HasSubstr("Max-Age=0"));
  EXPECT_EQ(logins_.Check(one, kFirst), Verdict::no);
  EXPECT_EQ(logins_.Check(other, kFirst), Verdict::yes);
  logins_.SetToken(kRight);
  EXPECT_EQ(logins_.Check(other, kFirst), Verdict::yes) << "the same one";
  logins_.SetToken("another-token-of-it");
  EXPECT_EQ(logins_.Check(other, kFirst), Verdict::no);
}

TEST_F(LoginsTest, ProgramsShowTheTokenItself) {
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
    EXPECT_EQ(logins_.Check(From("10.0.0.7", "authorization", header), kFirst), verdict) << header;
  }
}

TEST_F(LoginsTest, FiveWrongTokensAMinuteAndAnAddress) {
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(logins_.Open(From("10.0.0.7"), "wrong", false, kFirst + i * 1s).verdict, Verdict::no);
  }
  EXPECT_EQ(logins_.Open(From("10.0.0.7"), kRight, false, kFirst + 59s).verdict, Verdict::wait);
  EXPECT_EQ(logins_.Check(From("10.0.0.7", "authorization", std::string("Bearer ") + kRight),
                          kFirst + 59s),
            Verdict::wait);
  EXPECT_EQ(logins_.Open(From("10.0.0.8"), kRight, false, kFirst + 59s).verdict, Verdict::yes);
  EXPECT_EQ(logins_.Open(From("10.0.0.7"), kRight, false, kFirst + 60s).verdict, Verdict::yes);
}

TEST_F(LoginsTest, ManyAddressesTakeNoMoreRoom) {
  for (std::size_t i = 0; i < 3 * Logins::kMostAddresses; ++i) {
    logins_.Open(From("10.0." + std::to_string(i / 256) + "." + std::to_string(i % 256)), "wrong",
                 false, kFirst + i * 1ms);
  }
  EXPECT_EQ(logins_.Open(From("10.0.0.1"), kRight, false, kFirst + 4s).verdict, Verdict::yes);
}

}  // namespace
}  // namespace baudgate::web
