// `baudgate users`: changes and lists the users file (gateway/outputs/users/user_file.h). A running
// gateway reads a changed file within a second.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <ostream>
#include <string>

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

}  // namespace baudgate::tools
