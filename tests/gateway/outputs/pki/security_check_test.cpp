// Tests of `CheckSecurity`, which names each fault with its file, and of `baudgate certs dds`.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/pki/security_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <sys/stat.h>

#include <sstream>

#include "gateway/outputs/pki/demo_pki.h"
#include "gateway/tools/cli/offline/certs.h"
#include "tests/gateway/outputs/pki/pki_folder.h"
#include "transports/openssl.h"

namespace baudgate::pki {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kNow;
using ::testing::Not;
using testing::PkiFolder;
using testing::ReadText;
using ::testing::StartsWith;
using testing::WriteText;

class SecurityCheck : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(folder_.Make({"g"}, 1, kNow).ok());
    ASSERT_TRUE(other_.Make({"g"}, 0, kNow).ok());
  }
  std::vector<std::string> Found(WallTime now = kNow) const {
    std::vector<std::string> found;
    for (const Finding& one : CheckSecurity(files_, now).findings) {
      std::string text = (one.warning ? "warning " : "") + one.key + ": " + one.sentence;
      for (const PkiFolder* folder : {&folder_, &other_}) {
        for (std::size_t at; (at = text.find(folder->path())) != std::string::npos;) {
          text.erase(at, folder->path().string().size() + 1);
        }
      }
      found.push_back(text);
    }
    return found;
  }

  const PkiFolder folder_{"check"};
  const PkiFolder other_{"other"};
  config::DdsSecurity files_ = folder_.Of("g");
};

TEST_F(SecurityCheck, ReportsExpiredAndExpiringFiles) {
  EXPECT_THAT(Found(), IsEmpty());
  EXPECT_THAT(
      Found(kNow + kDemoValidity - 59 * 24h),
      ElementsAre(
          "warning identity: g/identity.pem expires on 2031-11-21; have a new one issued",
          "warning permissions: g/permissions.p7s expires on 2031-11-21; have a new file signed"));
  EXPECT_THAT(
      Found(kNow + kDemoValidity + 1s),
      ElementsAre("identity: g/identity.pem expired on 2031-11-21; have a new one issued",
                  "permissions: g/permissions.p7s expired on 2031-11-21; have a new file signed"));
  EXPECT_THAT(Found(kNow - 48h),
              ElementsAre(StartsWith("ca: g/ca.pem is not valid before 2026-11-21T00:00:00.000Z"),
                          StartsWith("identity: g/identity.pem is not valid before ")));
}

TEST_F(SecurityCheck, ReportsFilesOfAnotherAuthority) {
  files_.ca = other_.In("g/ca.pem");
  EXPECT_THAT(Found(),
              ElementsAre(StartsWith("identity: g/identity.pem was not issued by g/ca.pem ("),
                          StartsWith("governance: g/governance.p7s is not signed by g/ca.pem, or "),
                          StartsWith("permissions: g/permissions.p7s is not signed by ")));
  files_ = folder_.Of("g");
  files_.permissions_ca = other_.In("g/ca.pem");
  files_.governance = other_.In("g/governance.p7s");
  files_.permissions = other_.In("g/permissions.p7s");
  EXPECT_THAT(Found(), IsEmpty()) << "documents may be signed by another one";
}

TEST_F(SecurityCheck, ReportsAKeyOfAnotherCertificate) {
  files_.key = folder_.In("subscriber-1/key.pem");
  EXPECT_THAT(Found(), ElementsAre("key: subscriber-1/key.pem is not the key of g/identity.pem"));
}

TEST_F(SecurityCheck, ReportsAWorldReadableKey) {
  fs::permissions(files_.key, fs::perms::others_read, fs::perm_options::add);
  EXPECT_THAT(
      Found(),
      ElementsAre(
          "warning key: g/key.pem can be read or changed by every user; run: chmod o= g/key.pem"));
}

TEST_F(SecurityCheck, ReportsAKeyWithAPassword) {
  const tls::PrivateKey key = tls::ParseKey(ReadText(files_.key), {});
  ASSERT_NE(key, nullptr);
  const tls::Bio to(BIO_new(BIO_s_mem()));
  ASSERT_EQ(PEM_write_bio_PKCS8PrivateKey(to.get(), key.get(), EVP_aes_256_cbc(), "plinth-42", 9,
                                          nullptr, nullptr),
            1);
  WriteText(files_.key, tls::Written(to));
  EXPECT_THAT(Found(), ElementsAre("key: g/key.pem is encrypted; set password_file"));
  files_.password_file = folder_.In("password");
  WriteText(files_.password_file, "wrong\n");
  EXPECT_THAT(Found(), ElementsAre("key: g/key.pem is encrypted, and the password in password_file "
                                   "is wrong"));
  WriteText(files_.password_file, "plinth-42\n");
  EXPECT_THAT(Found(), IsEmpty());
  EXPECT_EQ(CheckSecurity(files_, kNow).password, "plinth-42");
  WriteText(files_.password_file, "plinth-43\n");
  const auto found = Found();
  EXPECT_THAT(found, ElementsAre(StartsWith("key: g/key.pem is encrypted")));
  EXPECT_THAT(found.front(), Not(HasSubstr("plinth")));
}

TEST_F(SecurityCheck, ReportsMissingAndDamagedFiles) {
  for (const std::string& file : {files_.ca, files_.identity, files_.key}) {
    const std::string text = ReadText(file);
    WriteText(file, text.substr(0, text.size() / 2));
    EXPECT_FALSE(CheckSecurity(files_, kNow).FirstError().empty()) << file;
    fs::remove(file);
    EXPECT_THAT(CheckSecurity(files_, kNow).FirstError(),
                HasSubstr(file + " cannot be read: No such file or directory"));
    WriteText(file, text);
    fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  }
  for (const std::string& file : {files_.governance, files_.permissions}) {
    const std::string text = ReadText(file);
    std::string changed = text;
    changed.replace(changed.find("baudgate/"), 9, "baudgate?");
    WriteText(file, changed);
    EXPECT_THAT(CheckSecurity(files_, kNow).FirstError(), HasSubstr(file + " is not signed by "));
    WriteText(file, "");
    EXPECT_THAT(CheckSecurity(files_, kNow).FirstError(), HasSubstr(file + " is not signed by "));
    WriteText(file, text);
  }
  EXPECT_THAT(Found(), IsEmpty());
}

TEST_F(SecurityCheck, ReportsPermissionsOfAnotherSubject) {
  files_.permissions = folder_.In("subscriber-1/permissions.p7s");
  EXPECT_THAT(Found(), ElementsAre("warning permissions: subscriber-1/permissions.p7s has no "
                                   "grant for CN=g, the subject of g/identity.pem"));
}

TEST_F(SecurityCheck, RecognisesAGovernanceWithUnprotectedMessages) {
  const Issued authority{ReadText(folder_.In("ca/ca.pem")), ReadText(folder_.In("ca/key.pem"))};
  std::string xml = Governance();
  const std::string kind = "<rtps_protection_kind>ENCRYPT";
  xml.replace(xml.find(kind), kind.size(), "<rtps_protection_kind>NONE");
  const auto document = SignDocument(authority, xml);
  ASSERT_TRUE(document.ok());
  WriteText(files_.governance, *document);
  const SecurityReport report = CheckSecurity(files_, kNow);
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_FALSE(report.messages_protected);
}

mode_t ModeOf(const std::string& file) {
  struct ::stat about {};
  EXPECT_EQ(::stat(file.c_str(), &about), 0) << file;
  return about.st_mode & 07777;
}

TEST(DemoPki, CreatesTheRequestedFolders) {
  const PkiFolder folder("makes");
  const auto made = folder.Make({"sub-7", "sub-8"}, 2, kNow);
  ASSERT_TRUE(made.ok()) << made.error();
  EXPECT_THAT(*made, ElementsAre(folder.In("ca"), folder.In("sub-7"), folder.In("sub-8"),
                                 folder.In("subscriber-1"), folder.In("subscriber-2")));
  EXPECT_EQ(ModeOf(folder.In("ca/key.pem")), 0600U);
  EXPECT_EQ(ModeOf(folder.In("sub-7/key.pem")), 0600U);
  for (const char* name : {"sub-7", "sub-8", "subscriber-1", "subscriber-2"}) {
    const SecurityReport report = CheckSecurity(folder.Of(name), kNow);
    EXPECT_THAT(report.findings, IsEmpty()) << report.findings.front().sentence;
    EXPECT_EQ(report.subject, std::string("CN=") + name);
    EXPECT_EQ(report.valid_until, kNow + kDemoValidity);
    EXPECT_TRUE(report.messages_protected);
  }
}

TEST(DemoPki, GrantsEachRoleItsPermissions) {
  const PkiFolder folder("rights");
  ASSERT_TRUE(folder.Make({"g"}, 1, kNow, kDemoValidity, 1).ok());
  const std::string write_only = "<topics><topic>baudgate/write</topic></topics>";
  const std::string all = "<topics><topic>baudgate/*</topic></topics>";
  const std::string gateway = ReadText(folder.In("g/permissions.p7s"));
  EXPECT_THAT(gateway, HasSubstr("<subscribe>\r\n          " + write_only));
  EXPECT_THAT(gateway, HasSubstr("<publish>\r\n          <topics><topic>baudgate/[!w]*</topic>"));
  EXPECT_THAT(gateway, HasSubstr("<topic>baudgate/write_reply</topic>"));
  EXPECT_THAT(gateway, Not(HasSubstr("<publish>\r\n          " + write_only)));
  EXPECT_THAT(gateway, Not(HasSubstr("baudgate/*")));
  const std::string subscriber = ReadText(folder.In("subscriber-1/permissions.p7s"));
  EXPECT_THAT(subscriber, Not(HasSubstr("<publish>")));
  EXPECT_THAT(subscriber, HasSubstr("<subscribe>"));
  const std::string writer = ReadText(folder.In("writer-1/permissions.p7s"));
  EXPECT_THAT(writer, HasSubstr("<publish>\r\n          " + write_only));
  for (const std::string& text : {subscriber, writer}) {
    EXPECT_THAT(text, HasSubstr("<subscribe>\r\n          " + all));
  }
  for (const std::string& text : {gateway, subscriber, writer}) {
    EXPECT_THAT(text, HasSubstr("<default>DENY</default>"));
  }
}

TEST(DemoPki, AddsFoldersOfTheSameAuthorityAndOverwritesNothing) {
  const PkiFolder folder("more");
  ASSERT_TRUE(folder.Make({"g"}, 1, kNow).ok());
  const std::string key = ReadText(folder.In("g/key.pem"));
  const auto again = folder.Make({"g"}, 1, kNow);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error(), folder.In("g") + " is there already");
  EXPECT_FALSE(std::filesystem::exists(folder.In("subscriber-2")));
  EXPECT_EQ(ReadText(folder.In("g/key.pem")), key);
  const auto more = folder.Make({"h"}, 1, kNow);
  ASSERT_TRUE(more.ok()) << more.error();
  EXPECT_THAT(*more, ElementsAre(folder.In("h"), folder.In("subscriber-2")));
  EXPECT_EQ(ReadText(folder.In("g/ca.pem")), ReadText(folder.In("h/ca.pem")));
  EXPECT_THAT(CheckSecurity(folder.Of("h"), kNow).findings, IsEmpty());
}

TEST(Certs, PrintsTheSettingsAndRefusesToOverwrite) {
  const PkiFolder folder("certs");
  std::ostringstream out, err;
  EXPECT_EQ(tools::RunCerts({folder.path(), {"sub-7"}, 1}, out, err), 0) << err.str();
  EXPECT_THAT(out.str(), HasSubstr("dds: { security: " + folder.In("sub-7") + " }"));
  EXPECT_THAT(out.str(), HasSubstr("watch --security " + folder.In("subscriber-1")));
  EXPECT_EQ(tools::RunCerts({folder.path(), {}, 1}, out, err), 0) << err.str();
  EXPECT_THAT(out.str(), HasSubstr("watch --security " + folder.In("subscriber-2")));
  EXPECT_EQ(tools::RunCerts({folder.path(), {}, {}}, out, err), 4);
  EXPECT_THAT(err.str(),
              HasSubstr("already contains a certificate authority; add the identities to issue"));
  EXPECT_EQ(tools::RunCerts({folder.path(), {"sub-7"}, 0}, out, err), 4);
  EXPECT_THAT(err.str(), HasSubstr("is there already; no file is overwritten"));
  EXPECT_EQ(tools::RunCerts({folder.path(), {"../x"}, 0}, out, err), 2);
  EXPECT_FALSE(std::filesystem::exists(folder.path().parent_path() / "x"));
}

}  // namespace
}  // namespace baudgate::pki
