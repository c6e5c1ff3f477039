// A protocol that uses the profiles of another beside its own: found by name, listed, and named in
// messages.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>

#include "config/catalog/catalog.h"
#include "config/profile.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

class SharedProfiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    root_ = std::filesystem::path(::testing::TempDir()) / ("shared-profiles-" + name);
    std::filesystem::remove_all(root_);
    Put("owner", "common");
    Put("owner", "both");
    Put("guest", "both");
    guest_.profiles_of = "owner";
    catalog_.protocols = {{"owner", &owner_}, {"guest", &guest_}};
    catalog_.profile_dirs = {root_};
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  void Put(const std::string& protocol, const std::string& profile) {
    std::filesystem::create_directories(root_ / protocol);
    std::ofstream(root_ / protocol / (profile + ".yaml")) << "device: x\npoints: []\n";
  }
  std::string Listed(const std::string& protocol) {
    std::string text;
    for (const auto& file : catalog_.Profiles(protocol)) {
      text += (text.empty() ? "" : " ") + file.protocol + "/" + file.name;
    }
    return text;
  }

  std::filesystem::path root_;
  Protocol owner_ = MakeFakeProtocol("owner");
  Protocol guest_ = MakeFakeProtocol("guest");
  config::Catalog catalog_;
};

TEST_F(SharedProfiles, AreFoundByName) {
  EXPECT_EQ(catalog_.FindProfile("guest", "common"), root_ / "owner" / "common.yaml");
  EXPECT_EQ(catalog_.FindProfile("guest", "both"), root_ / "guest" / "both.yaml") << "its own";
  EXPECT_EQ(catalog_.FindProfile("owner", "both"), root_ / "owner" / "both.yaml");
  EXPECT_FALSE(catalog_.FindProfile("guest", "none").has_value());
  Put("guest", "own");
  EXPECT_FALSE(catalog_.FindProfile("owner", "own").has_value()) << "not the other way round";
}

TEST_F(SharedProfiles, AreListedOnce) {
  EXPECT_EQ(Listed("guest"), "guest/both owner/common");
  EXPECT_EQ(Listed("owner"), "owner/both owner/common");
  EXPECT_EQ(Listed(""), "guest/both owner/both owner/common");
}

TEST_F(SharedProfiles, AreNamedWhereOneIsMissed) {
  const auto missed = config::LocateProfile("comon", guest_, catalog_, {});
  ASSERT_FALSE(missed);
  EXPECT_NE(missed.error().find("common"), std::string::npos) << missed.error();
  EXPECT_NE(missed.error().find((root_ / "guest").string()), std::string::npos);
  EXPECT_NE(missed.error().find((root_ / "owner").string()), std::string::npos);
}

}  // namespace
}  // namespace baudgate::testing
