// The files of the page as they are sent.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <regex>

#include "gateway/outputs/web/web_server.h"

namespace baudgate::web {
namespace {

/// A proxy may show the page below a path of its own: "/js/main.js" would lead out of it.
TEST(Assets, NoFileOfThePageNamesAPathFromTheRoot) {
  const std::regex from_root(R"re([`'"(]/[a-z][^`'")]*)re");
  int read = 0;
  for (const PackedFile& file : PackedFiles()) {
    const std::string path(file.path);
    if (path == "/chart.js" || path.ends_with(".svg")) continue;  // a library and a picture
    Request request;
    request.path = path;
    const auto response = AssetResponse(request);
    ASSERT_TRUE(response) << path;
    const std::string body(response->body);
    std::smatch found;
    EXPECT_FALSE(std::regex_search(body, found, from_root)) << path << ": " << found.str();
    ++read;
  }
  EXPECT_GT(read, 30);
}

}  // namespace
}  // namespace baudgate::web
