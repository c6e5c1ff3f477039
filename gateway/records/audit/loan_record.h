// The two records of a loan of a port to a network client: its beginning and its end. Neither has
// what the client sent.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/records/audit/write_log.h"

namespace baudgate::audit {

struct Loan {
  std::string line;
  std::string client;  ///< "10.0.0.7:40112"
  Now began{};
};

/// `how`: "at 127.0.0.1:4001, raw, for 30min".
void BeginLoan(WriteLog& log, const Loan& loan, const std::string& how);
/// `how`: "it has left; 120 bytes to the port, 340 from it".
void EndLoan(WriteLog& log, const Loan& loan, const std::string& how, Now now);

}  // namespace baudgate::audit
