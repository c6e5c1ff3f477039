// Tests that modules with a wrong ABI tag are refused, and which profile folder takes precedence.
// SPDX-License-Identifier: Apache-2.0
#include "config/catalog/modules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "protocols/entry.h"

namespace baudgate::config {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

TEST(Modules, OfAnotherContractAreRefusedWithoutACall) {
  ASSERT_EQ(setenv("BAUDGATE_MODULES", ODD_MODULES, 1), 0);
  const Modules modules = LoadModules();
  unsetenv("BAUDGATE_MODULES");
  EXPECT_FALSE(modules.catalog.protocols.contains("other"));
  EXPECT_THAT(modules.refused,
              Contains(AllOf(HasSubstr("/other.so was built for gcc0-cxxabi0 contract 0, "),
                             HasSubstr("this gateway needs modules for " +
                                       std::string(protocols::kContractTag)),
                             HasSubstr("install both from one release"))));
  EXPECT_THAT(modules.refused,
              Contains(HasSubstr("/older.so was built for an older release of baudgate")));
  EXPECT_THAT(
      modules.refused,
      Contains(HasSubstr(
          "/stranger.so is not a protocol module of baudgate; remove the file from this folder")));
}

TEST(Modules, ProfilesOfThisMachineGoBeforeShippedProfiles) {
  using Folders = std::vector<std::filesystem::path>;
  EXPECT_EQ(ProfileFolders({"/given", "/binary", "/usr/share/baudgate"}),
            (Folders{"/given/profiles", "/etc/baudgate/profiles", "/binary/profiles",
                     "/usr/share/baudgate/profiles"}));
  EXPECT_EQ(ProfileFolders({"/binary", "/usr/share/baudgate"}).front(), "/etc/baudgate/profiles");
}

}  // namespace
}  // namespace baudgate::config
