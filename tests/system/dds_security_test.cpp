// DDS Security with the whole program: `certs dds`, a gateway with its files, `watch` with and
// without, and a gateway whose files are not right.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include "gateway/base/time.h"
#include "gateway/outputs/pki/demo_pki.h"
#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class DdsSecurity : public ThreeDevices {
 protected:
  std::string Pki(const std::string& file = {}) const {
    return (directory() / "pki" / file).string();
  }
  std::string SecuredYaml() const {
    std::string yaml = Yaml(true);
    const std::string enabled = "dds: { enabled: true,";
    // Relative: to the configuration, wherever the DDS process runs.
    return yaml.replace(yaml.find(enabled), enabled.size(),
                        enabled + " security: pki/" + gateway() + ",");
  }
  void MakeCertificates(int subscribers) const {
    const Finished certs = Command({"certs", "dds", Pki(), "--gateway", gateway(), "--subscribers",
                                    std::to_string(subscribers)});
    ASSERT_EQ(certs.code, 0) << certs.errors;
  }
  std::vector<std::string> Watch(const std::string& folder) const {
    std::vector<std::string> words = {"watch",     "--domain", std::to_string(domain()),
                                      "--gateway", gateway(),  "--json"};
    if (!folder.empty()) words.insert(words.end(), {"--security", Pki(folder)});
    return words;
  }
  Json DdsStatus() const {
    const Finished status = Command({"status", "--json", "--socket",
                                     (directory() / "baudgate" / (gateway() + ".sock")).string()});
    return Json::parse(status.output, nullptr, false).value("dds", Json());
  }
};

TEST_F(DdsSecurity, WhoHasACertificateSeesValues) {
  MakeCertificates(1);
  StartTwins();
  daemon = StartDaemon(SecuredYaml());
  const auto open = Start(Watch(""));
  const auto watch = Start(Watch("subscriber-1"));
  EXPECT_TRUE(Eventually([&] {
    return watch->Output().find("\"point\":\"current_l3\",\"value\":63") != std::string::npos;
  })) << watch->Errors()
      << daemon->Errors();
  EXPECT_EQ(open->Output(), "");
  EXPECT_TRUE(open->Running());
  const Finished check = Command({"check", "-c", (directory() / "baudgate.yaml").string()});
  EXPECT_EQ(check.code, 0) << check.errors;
  EXPECT_THAT(check.output, HasSubstr("  security   CN=" + gateway() + ", until 20"));
}

TEST_F(DdsSecurity, WithoutRightFilesNothingIsPublishedUntilTheyAreRight) {
  MakeCertificates(1);
  const fs::path key = Pki(gateway() + "/key.pem");
  fs::rename(key, Pki("away"));
  StartTwins();
  daemon = StartDaemon(SecuredYaml());
  ASSERT_TRUE(EventuallyLogged(*daemon, "dds: the process has not begun: dds: security: key: "));
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F)) << "lines and Modbus run";
  EXPECT_THAT(DdsStatus().dump(), HasSubstr(key.string() + " cannot be read: No such file"));
  const Finished check = Command({"check", "-c", (directory() / "baudgate.yaml").string()});
  EXPECT_EQ(check.code, 3);
  EXPECT_THAT(check.errors, HasSubstr("baudgate.yaml:3:"));
  EXPECT_THAT(check.errors, HasSubstr("error: key: " + key.string() + " cannot be read"));
  const auto open = Start(Watch(""));
  const auto watch = Start(Watch("subscriber-1"));
  fs::rename(Pki("away"), key);
  EXPECT_TRUE(Eventually([&] { return !watch->Output().empty(); })) << watch->Errors();
  EXPECT_EQ(open->Output(), "") << "it was never open";
}

TEST_F(DdsSecurity, AnIdentityThatHasExpiredSinceIsNotLetIn) {
  MakeCertificates(1);
  constexpr Duration kShort = 8s;  // enough to begin on a busy machine
  const auto begun = ReadClocks();
  const auto made =
      pki::WriteDemoPki({Pki(), {}, 1, 0, kShort}, begun.wall);  // subscriber-2, for a few seconds
  ASSERT_TRUE(made.ok()) << made.error();
  const auto expired = Start(Watch("subscriber-2"));
  ASSERT_TRUE(Eventually([&] { return ReadClocks().instant > begun.instant + kShort + 1s; }));
  ASSERT_TRUE(expired->Running()) << expired->Errors();
  StartTwins();
  daemon = StartDaemon(SecuredYaml());
  const auto watch = Start(Watch("subscriber-1"));
  ASSERT_TRUE(Eventually([&] { return !watch->Output().empty(); })) << watch->Errors();
  EXPECT_EQ(expired->Output(), "");
  EXPECT_TRUE(expired->Running());
}

}  // namespace
}  // namespace baudgate::system_test
