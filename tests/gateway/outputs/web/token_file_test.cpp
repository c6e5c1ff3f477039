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

using ::testing::HasSubstr;

TEST(TokenFile, IsReadByItsOwnerAlone) {
  std::string form = (std::filesystem::temp_directory_path() / "baudgate-token-XXXXXX").string();
  ASSERT_NE(::mkdtemp(form.data()), nullptr);
  const std::string file = form + "/token";
  EXPECT_THAT(ReadToken(file).error(), HasSubstr("openssl rand -hex 32"));
  const struct {
    std::string text;
    mode_t mode;
    std::string says;  ///< empty: it is good
  } kFiles[] = {
      {"0123456789abcdef\n", 0600, ""},
      {"0123456789abcdef\nsecond line", 0400, ""},
      {"0123456789abcdef", 0640, "chmod 0600"},
      {"0123456789abcdef", 0604, "chmod 0600"},
      {"short\n", 0600, "a token of 5 characters"},
      {"", 0600, "a token of 0 characters"},
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
  EXPECT_THAT(ReadToken(form).error(), HasSubstr("no regular file"));
  std::filesystem::remove_all(form);
}

}  // namespace
}  // namespace baudgate::web
