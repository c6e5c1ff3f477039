// A source that a comment names is there: in the folder of the comment, or under the path that
// stands before its name.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>

#include "tests/layers/modules.h"

namespace baudgate::layers {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

using Exists = std::function<bool(const std::string& path)>;

/// "gateway/bus/jobs/job.h:3: there is no gateway/bus/jobs/jobs.cpp".
std::vector<std::string> MissingFiles(const std::string& path, std::istream& source,
                                      const Exists& exists) {
  static const std::regex kName(R"([\w./-]*\w\.(?:h|cpp)\b)");
  std::vector<std::string> missing;
  int number = 0;
  for (std::string line; std::getline(source, line);) {
    ++number;
    const std::size_t comment = line.find("//");
    if (comment == std::string::npos) continue;
    const std::string text = line.substr(comment + 2);
    for (std::sregex_iterator at(text.begin(), text.end(), kName), end; at != end; ++at) {
      const std::string name = at->str();
      const bool has_path = name.find('/') != std::string::npos;
      const std::string file = has_path ? name : FolderOf(path) + "/" + name;
      if (!exists(file)) {
        missing.push_back(path + ":" + std::to_string(number) + ": there is no " + file);
      }
    }
  }
  return missing;
}

TEST(FileNames, WhatACommentNamesIsThere) {
  for (const char* top : {"config", "protocols", "transports", "gateway"}) {
    for (const auto& entry : fs::recursive_directory_iterator(top)) {
      const std::string extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      std::ifstream source(entry.path());
      EXPECT_THAT(MissingFiles(entry.path().string(), source,
                               [](const std::string& path) { return fs::exists(path); }),
                  IsEmpty());
    }
  }
}

TEST(FileNames, OneThatIsGoneIsNamedWithItsLine) {
  std::istringstream source(
      "// from session.cpp, by way of gateway/bus/exchange/line.h\n"
      "#include \"gateway/bus/gone.h\"\n"
      "int x;  // see modules.h\n");
  EXPECT_THAT(
      MissingFiles("gateway/bus/jobs/job.cpp", source,
                   [](const std::string& path) { return path == "gateway/bus/exchange/line.h"; }),
      ElementsAre("gateway/bus/jobs/job.cpp:1: there is no gateway/bus/jobs/session.cpp",
                  "gateway/bus/jobs/job.cpp:3: there is no gateway/bus/jobs/modules.h"));
}

}  // namespace
}  // namespace baudgate::layers
