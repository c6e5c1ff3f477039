// The settings of a relay's twin, kept in a file by the commands that users have.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

class SettingsOfATwin : public ThreeDevices {
 protected:
  void SetUp() override {
    relay = StartTwin("relay", "spaj140c", "7");
    daemon = StartDaemon(WithSocket(Head()) +
                         Line("relay", "spabus", "address: 7, profile: spaj140c, unit: 1, slow: 1s",
                              "serial: 38400 7E1"));
    ASSERT_TRUE(Eventually([&] { return Settings("dump", {}).code == 0; }));
  }

  std::string file() const { return (directory() / "relay.yaml").string(); }
  Finished Settings(const std::string& what, std::vector<std::string> more) const {
    more.insert(more.begin(), {"settings", what, "relay.relay-1"});
    return Ask(more);
  }
};

TEST_F(SettingsOfATwin, AreDumpedComparedAndNotWrittenWithoutPermission) {
  ASSERT_EQ(Settings("dump", {file()}).code, 0);
  EXPECT_EQ(Settings("dump", {file()}).code, 4) << "it is there";
  const Finished same = Settings("compare", {file()});
  EXPECT_EQ(same.code, 0) << same.errors;
  EXPECT_THAT(same.output, HasSubstr("relay.relay-1 (SPCJ 4D29): no setting differs"));

  std::ifstream stream(file());
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  const std::string held = "item: \"S24\", value: \"0.08\"";
  ASSERT_NE(text.find(held), std::string::npos) << text;
  text.replace(text.find(held), held.size(), "item: \"S24\", value: 0.3");
  std::ofstream(file()) << text;
  for (const char* what : {"compare", "restore"}) {
    const Finished differs = Settings(what, {file()});
    EXPECT_EQ(differs.code, 3) << what;
    EXPECT_THAT(differs.output, HasSubstr("main_phase_high_time  S24   0.08    0.3   s"));
  }
  for (const bool confirmed : {false, true}) {
    const Finished denied =
        Settings("restore", confirmed ? std::vector<std::string>{file(), "--confirm"}
                                      : std::vector<std::string>{file()});
    EXPECT_EQ(denied.code, 3);
    EXPECT_THAT(denied.errors, HasSubstr("main_phase_high_time (S24) would be denied: "
                                         "'main_phase_high_time' is not in the device's 'write'"));
    EXPECT_THAT(denied.output, HasSubstr("nothing is written: 1 setting of 1 would be denied"));
  }
  EXPECT_EQ(Settings("restore", {}).code, 2);
}

}  // namespace
}  // namespace baudgate::system_test
