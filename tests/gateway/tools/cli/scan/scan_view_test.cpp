// Tests of the texts at the end of `baudgate scan`, and of invalid targets.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <sstream>

#include "gateway/tools/cli/scan/scan.h"
#include "gateway/tools/cli/scan/target.h"

namespace baudgate::tools {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string Concluded(const scan::Report& report) {
  const ScanOptions options;
  const StopSignals stop;
  std::ostringstream out;
  std::ostringstream err;
  ScanView(
      options, false, stop, [] {}, out, err)
      .Conclude(report);
  return out.str();
}

TEST(ScanView, SilenceIsReportedOnlyAfterAQuery) {
  scan::Report report;
  report.ended = false;
  EXPECT_THAT(Concluded(report), AllOf(HasSubstr("ended before the first request"),
                                       Not(HasSubstr("No device has answered"))));
  report.ended = true;
  EXPECT_THAT(Concluded(report), HasSubstr("no protocol uses the addresses in --addresses"));
  report.asked = true;
  EXPECT_THAT(Concluded(report), HasSubstr("No device has answered"));
}

TEST(ScanTarget, IsAPortOrALine) {
  for (const char* target :
       {"/dev/ttyUSB0", "tcp://10.0.0.5:4001", "bay-1", "bay-1.feeder", "ttyS1"}) {
    EXPECT_TRUE(CheckTarget(target)) << target;
  }
  const Status server = CheckTarget("127.0.0.1:4001");
  ASSERT_FALSE(server);
  EXPECT_THAT(server.error(), HasSubstr("tcp://127.0.0.1:4001"));
}

}  // namespace
}  // namespace baudgate::tools
