// Tests of the content of a support bundle, with and without a gateway.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/bundle/support_bundle.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::tools {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class BundleTest : public control::ControlTest {
 protected:
  BundleTest() {
    options_.file = (directory_ / "bundle.tar.gz").string();
    options_.config = (directory_ / "baudgate.yaml").string();
    options_.socket = path();
    options_.log = [] { return std::string("a line of the log\n"); };
    std::ofstream(options_.config) << "gateway: { name: a }\n";
  }
  int Run() { return RunSupportBundle(options_, {}, status::kNow.wall, out_, err_); }
  std::map<std::string, std::string> Files() const {
    const auto into = directory_ / "unpacked";
    std::filesystem::create_directory(into);
    const std::string unpack =
        "tar --extract --gzip --file='" + options_.file + "' --directory='" + into.string() + "'";
    EXPECT_EQ(std::system(unpack.c_str()), 0);
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(into)) {
      if (!entry.is_regular_file()) continue;
      std::ostringstream content;
      content << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      files[std::filesystem::relative(entry.path(), into).string()] = content.str();
    }
    return files;
  }

  BundleOptions options_;
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(BundleTest, ContainsAllFilesOfARunningGateway) {
  records::TraceRecord record;
  record.text = "port open";
  lines_.recorded = {record};
  StartServer();
  EXPECT_EQ(Run(), 0) << err_.str();
  EXPECT_THAT(err_.str(), IsEmpty());
  EXPECT_THAT(out_.str(), HasSubstr("check the contents before you send the file"));
  auto files = Files();
  EXPECT_THAT(files["baudgate-support/status.txt"], HasSubstr("substation-7: baudgate 1.2.3"));
  EXPECT_EQ(status::Json::parse(files["baudgate-support/status.json"])["gateway"], "substation-7");
  EXPECT_THAT(files["baudgate-support/trace/bay-1.trace"], HasSubstr("# line bay-1, port "));
  EXPECT_THAT(files["baudgate-support/trace/io.trace"], HasSubstr("# port open\n"));
  EXPECT_EQ(files["baudgate-support/log.txt"], "a line of the log\n");
  EXPECT_THAT(files["baudgate-support/configuration.yaml"], HasSubstr("gateway:\n  name: a\n"));
  EXPECT_THAT(files["baudgate-support/versions.txt"], HasSubstr("the gateway: baudgate 1.2.3\n"));
  EXPECT_THAT(files["baudgate-support/contents.txt"], Not(HasSubstr("missing")));
  struct stat state {};
  ASSERT_EQ(::stat(options_.file.c_str(), &state), 0);
  EXPECT_EQ(state.st_mode & 0777U, 0600U);
}

TEST_F(BundleTest, ListsMissingFilesWithoutAGateway) {
  options_.log = [] { return Result<std::string>(Error{"nobody keeps one"}); };
  options_.config = (directory_ / "nowhere.yaml").string();
  EXPECT_EQ(Run(), 0);
  auto files = Files();
  EXPECT_EQ(files.size(), 2U) << "versions.txt and contents.txt";
  const std::string contents = files["baudgate-support/contents.txt"];
  EXPECT_THAT(contents, HasSubstr("missing: status and traces: no gateway answers at "));
  EXPECT_THAT(contents, HasSubstr("missing: log: nobody keeps one\n"));
  EXPECT_THAT(contents, HasSubstr("missing: configuration: "));
  EXPECT_THAT(err_.str(), HasSubstr("baudgate: missing: log: nobody keeps one\n"));
}

TEST_F(BundleTest, DoesNotWaitForAConfigurationThatIsAPipe) {
  options_.config = (directory_ / "pipe.yaml").string();
  ASSERT_EQ(::mkfifo(options_.config.c_str(), 0600), 0);
  EXPECT_EQ(Run(), 0);
  EXPECT_THAT(Files()["baudgate-support/contents.txt"],
              HasSubstr("pipe.yaml: is not a regular file"));
}

TEST_F(BundleTest, RefusesToOverwriteAFile) {
  std::ofstream(options_.file) << "mine";
  EXPECT_EQ(Run(), 4);
  EXPECT_THAT(err_.str(), HasSubstr("File exists"));
}

}  // namespace
}  // namespace baudgate::tools
