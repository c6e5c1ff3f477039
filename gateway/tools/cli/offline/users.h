// `baudgate users` and `baudgate audit`: who may use the gateway, and what users did. The first
// changes and lists the users file (gateway/outputs/users/user_file.h). A running
// gateway reads a changed file within a second.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"

namespace baudgate::tools {

struct UsersOptions {
  enum class What { add, remove, token, list };
  What what = What::list;
  std::string file;
  std::string name{};
  std::string role{};
  bool no_password = false;  ///< add: the user can log in only with tokens
  int days = 365;            ///< token: how long it is valid
};

/// `in`: the password, one line; from a terminal it is asked for twice and not shown. Exit codes: 0
/// done; 2 invalid name, role or password, or no such user; 4 the file cannot be used or written.
int RunUsers(const UsersOptions& options, std::istream& in, std::ostream& out, std::ostream& err);

struct JournalOptions {
  std::string config;   ///< configuration file, whose state folder has the journal
  bool verify = false;  ///< check the chain of hashes, and print no rows
  bool json = false;
};

/// `baudgate audit`: prints or verifies the security journal
/// (gateway/records/audit/security_journal.h). Exit codes: 0 done, and no row was changed; 1 a row
/// was changed or is missing; 3 wrong configuration; 4 the journal cannot be read.
int RunAudit(const JournalOptions& options, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err);

}  // namespace baudgate::tools
