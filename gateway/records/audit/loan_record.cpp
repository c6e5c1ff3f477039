// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/loan_record.h"

namespace baudgate::audit {
namespace {

constexpr const char* kLent = "lent";
constexpr const char* kBack = "back";

WriteRecord RecordOf(const Loan& loan, WallTime at) {
  WriteRecord record;
  record.kind = Kind::loan;
  record.time = record.last = at;
  record.client = Clipped(loan.client);
  record.line = loan.line;
  record.point = "port";
  return record;
}

void Keep(WriteLog& log, WriteRecord record, const std::string& how, Duration took) {
  if (const auto ticket = log.Begin(std::move(record))) {
    log.End(*ticket, {WriteEnd::ok, Clipped(how), took});
  }
}

}  // namespace

void BeginLoan(WriteLog& log, const Loan& loan, const std::string& how) {
  WriteRecord record = RecordOf(loan, loan.began.wall);
  record.value = std::string(kLent);
  Keep(log, std::move(record), how, {});
}

void EndLoan(WriteLog& log, const Loan& loan, const std::string& how, Now now) {
  WriteRecord record = RecordOf(loan, now.wall);
  record.before = std::string(kLent);
  record.value = std::string(kBack);
  Keep(log, std::move(record), how, now.instant - loan.began.instant);
}

}  // namespace baudgate::audit
