// What `baudgate certs dds` writes: who can read it, what is never written over, who may do what.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/pki/demo_pki.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <sstream>

#include "gateway/outputs/pki/security_check.h"
#include "gateway/tools/cli/offline/certs.h"
#include "tests/gateway/outputs/pki/pki_folder.h"

namespace baudgate::pki {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kNow;
using ::testing::Not;
using testing::PkiFolder;
using testing::ReadText;

mode_t ModeOf(const std::string& file) {
  struct ::stat about {};
  EXPECT_EQ(::stat(file.c_str(), &about), 0) << file;
  return about.st_mode & 07777;
}

TEST(DemoPki, MakesWhatIsAskedFor) {
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

TEST(DemoPki, AGatewayPublishesASubscriberSubscribesAndAWriterWrites) {
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

TEST(DemoPki, MoreComeFromTheSameAuthorityAndNothingIsWrittenOver) {
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

TEST(Certs, SaysWhatToWriteAndWhatItWouldNotDo) {
  const PkiFolder folder("certs");
  std::ostringstream out, err;
  EXPECT_EQ(RunCerts({folder.path(), {"sub-7"}, 1}, out, err), 0) << err.str();
  EXPECT_THAT(out.str(), HasSubstr("dds: { security: " + folder.In("sub-7") + " }"));
  EXPECT_THAT(out.str(), HasSubstr("watch --security " + folder.In("subscriber-1")));
  EXPECT_EQ(RunCerts({folder.path(), {}, 1}, out, err), 0) << err.str();
  EXPECT_THAT(out.str(), HasSubstr("watch --security " + folder.In("subscriber-2")));
  EXPECT_EQ(RunCerts({folder.path(), {}, {}}, out, err), 4);
  EXPECT_THAT(err.str(), HasSubstr("has an authority; name what it is to issue"));
  EXPECT_EQ(RunCerts({folder.path(), {"sub-7"}, 0}, out, err), 4);
  EXPECT_THAT(err.str(), HasSubstr("is there already; no file is overwritten"));
  EXPECT_EQ(RunCerts({folder.path(), {"../x"}, 0}, out, err), 2);
  EXPECT_FALSE(std::filesystem::exists(folder.path().parent_path() / "x"));
}

}  // namespace
}  // namespace baudgate::pki
