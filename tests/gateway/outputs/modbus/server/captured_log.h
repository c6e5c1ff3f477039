// `CapturedLog` captures the log, which goes to standard output because no test calls log::Begin.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "gateway/base/log_outlet.h"

namespace baudgate::modbus {

class CapturedLog {
 public:
  CapturedLog() {
    log::ForgetRepeats();
    testing::internal::CaptureStdout();
  }
  ~CapturedLog() {
    if (!ended_) testing::internal::GetCapturedStdout();
  }
  CapturedLog(const CapturedLog&) = delete;
  CapturedLog& operator=(const CapturedLog&) = delete;

  int CountLines(const std::string& part) {
    ended_ = true;
    std::istringstream text(testing::internal::GetCapturedStdout());
    int count = 0;
    for (std::string line; std::getline(text, line);) {
      if (line.find(part) != std::string::npos) ++count;
    }
    return count;
  }

 private:
  bool ended_ = false;
};

}  // namespace baudgate::modbus
