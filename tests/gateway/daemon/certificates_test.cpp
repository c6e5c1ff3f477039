// Test of `Certificates`: sentences, alarm and dates of certificates that end soon.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/certificates.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "gateway/outputs/pki/server_files.h"
#include "tests/gateway/outputs/pki/pki_folder.h"

namespace baudgate::daemon {
namespace {

using pki::testing::kNow;
using pki::testing::PkiFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr WallTime kEnd = kNow + pki::kServerValidity;

class CertificatesTest : public ::testing::Test {
 protected:
  CertificatesTest() {
    config_.web.on = true;
    config_.web.tls = FilesIn("web");
    config_.modbus.enabled = true;
    config_.modbus.listen.resize(1);
    config_.modbus.listen[0].host = "0.0.0.0";
    config_.modbus.listen[0].port = 802;
    config_.modbus.listen[0].tls = FilesIn("modbus");
    Issue("web", kNow);
    Issue("modbus", kNow + 24h);
  }

  config::TlsFiles FilesIn(const std::string& name) const {
    return {folder_.In(name + "/gateway.pem"), folder_.In(name + "/gateway.key"), ""};
  }
  void Issue(const std::string& name, WallTime from) const {
    ASSERT_TRUE(pki::WriteServerFiles(folder_.In(name), {"localhost"}, {}, from));
  }
  /// Waits until the thread has read the files and `holds` is true.
  template <typename Holds>
  static bool Eventually(Holds holds) {
    for (int i = 0; i < 1000 && !holds(); ++i) std::this_thread::sleep_for(5ms);
    return holds();
  }
  WallTime EndOf(std::size_t use) const {
    const auto ends = certificates_.ends();
    return use < ends.size() ? ends[use].until : WallTime{};
  }

  const PkiFolder folder_{"certificates"};
  config::Config config_;
  Certificates certificates_;
};

TEST_F(CertificatesTest, AlarmAndSentencesBegin30DaysBeforeTheEnd) {
  EXPECT_EQ(certificates_.Alarm(kNow), std::nullopt) << "nothing is known yet";
  certificates_.Apply(config_);
  ASSERT_TRUE(Eventually([this] { return certificates_.ends().size() == 2; }));
  EXPECT_EQ(certificates_.ends()[0].use, "web");
  EXPECT_EQ(certificates_.ends()[1].use, "listener 0.0.0.0:802");
  EXPECT_EQ(EndOf(0), kEnd);
  EXPECT_EQ(EndOf(1), kEnd + 24h);
  EXPECT_EQ(certificates_.Alarm(kEnd - 31 * 24h), "");
  EXPECT_THAT(certificates_.Sentences(kEnd - 31 * 24h), IsEmpty());
  EXPECT_THAT(*certificates_.Alarm(kEnd - 30 * 24h), HasSubstr("The certificate of web in "));
  EXPECT_THAT(certificates_.Sentences(kEnd - 30 * 24h),
              ElementsAre(HasSubstr("ends on 2028-11-21. Renew it: baudgate certs web DIR")));
  EXPECT_THAT(certificates_.Sentences(kEnd),
              ElementsAre(HasSubstr("has ended on 2028-11-21"),
                          HasSubstr("The certificate of listener 0.0.0.0:802 in ")));
}

TEST_F(CertificatesTest, FilesAreReadEachHour) {
  certificates_.Apply(config_);
  ASSERT_TRUE(Eventually([this] { return certificates_.ends().size() == 2; }));
  const Instant start = Instant() + 1h;
  certificates_.Tick({start, kNow});
  Issue("web", kNow + 48h);
  Issue("modbus", kNow + 48h);
  certificates_.Tick({start + 59min, kNow});
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(EndOf(1), kEnd + 24h) << "the hour is not over";
  certificates_.Tick({start + 60min, kNow});
  EXPECT_TRUE(Eventually([this] { return EndOf(1) == kEnd + 48h; }));
  EXPECT_EQ(EndOf(0), kEnd) << "the web server uses the old certificate until a reload";
  certificates_.Apply(config_);
  EXPECT_TRUE(Eventually([this] { return EndOf(0) == kEnd + 48h; }));
}

TEST_F(CertificatesTest, FilesThatCannotBeUsedGetASentenceAndNoAlarm) {
  std::filesystem::remove(folder_.In("modbus/gateway.key"));
  certificates_.Apply(config_);
  ASSERT_TRUE(Eventually([this] { return !certificates_.Sentences(kNow).empty(); }));
  EXPECT_THAT(certificates_.Sentences(kNow),
              ElementsAre(HasSubstr("listener 0.0.0.0:802: the key ")));
  EXPECT_EQ(certificates_.Alarm(kNow), "");
  EXPECT_EQ(certificates_.ends().size(), 1U);
}

}  // namespace
}  // namespace baudgate::daemon
