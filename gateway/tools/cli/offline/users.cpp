// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/users.h"

#include <fmt/format.h>
#include <grp.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "config/loader.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/system_trouble.h"
#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/base/whole_file.h"
#include "gateway/outputs/users/user_file.h"
#include "gateway/records/audit/security_journal.h"
#include "gateway/records/disk/state_folder.h"
#include "gateway/tools/cli/offline/check.h"

namespace baudgate::tools {
namespace {

/// Reads a line from the terminal without showing it. Ctrl-C ends the input, and the terminal gets
/// its settings back. Empty: the input was ended.
std::optional<std::string> AskHidden(const char* prompt, std::ostream& err) {
  termios before{};
  if (::tcgetattr(STDIN_FILENO, &before) != 0) return std::nullopt;
  termios hidden = before;
  hidden.c_lflag &= ~static_cast<tcflag_t>(ECHO | ISIG | ICANON);
  err << prompt << std::flush;
  ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &hidden);
  std::optional<std::string> text = std::string();
  for (char c = 0; ::read(STDIN_FILENO, &c, 1) == 1 && c != '\n' && c != '\r';) {
    constexpr char kCtrlC = 3;
    constexpr char kBackspace = 127;
    if (c == kCtrlC) {
      text.reset();
      break;
    }
    if (c != kBackspace) {
      *text += c;
    } else if (!text->empty()) {
      text->pop_back();
    }
  }
  ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before);
  err << '\n';
  return text;
}

/// Returns the password; empty: none was entered, and the error was reported.
std::optional<std::string> Password(std::istream& in, std::ostream& err) {
  if (&in == &std::cin && ::isatty(STDIN_FILENO) != 0) {
    const auto first = AskHidden("Password: ", err);
    const auto second = first ? AskHidden("The same again: ", err) : std::nullopt;
    if (first && second && *first == *second) return first;
    err << "users: " << (second ? "the two passwords differ" : "no password was entered")
        << "; nothing was changed\n";
    return std::nullopt;
  }
  std::string line;
  std::getline(in, line);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  if (!line.empty()) return line;
  err << "users: no password on the standard input; write it as one line, or add --no-password\n";
  return std::nullopt;
}

/// Writes the file. The file keeps its group; a new file gets the group `baudgate` if there is one,
/// so that the service can read it.
bool Write(const users::UserFile& users, const std::string& file, std::ostream& err) {
  struct stat before {};
  const bool existed = ::stat(file.c_str(), &before) == 0;
  const int error = WriteWhole(file, users.Text());
  if (error != 0) {
    err << "users: " << file << " cannot be written: " << SystemTrouble(error) << '\n';
    return false;
  }
  const group* const service = existed ? nullptr : ::getgrnam("baudgate");
  const gid_t gid = existed ? before.st_gid : service != nullptr ? service->gr_gid : ::getegid();
  if (gid != ::getegid() && ::chown(file.c_str(), static_cast<uid_t>(-1), gid) != 0) {
    err << "users: the gateway may not be able to read " << file << "; run: sudo chgrp baudgate "
        << file << '\n';
  }
  return true;
}

void Print(const users::UserFile& users, std::ostream& out) {
  std::size_t width = 4;
  for (const users::User& user : users.users()) width = std::max(width, user.name.size());
  out << fmt::format("{:<{}}  {:<8}  {:<8}  tokens valid until\n", "user", width, "role",
                     "password");
  for (const users::User& user : users.users()) {
    std::string until;
    for (const users::Token& token : users.tokens()) {
      if (token.user != user.name) continue;
      until += (until.empty() ? "" : ", ") + FormatWallTime(token.until).substr(0, 10);
    }
    out << fmt::format("{:<{}}  {:<8}  {:<8}  {}\n", user.name, width, Name(user.role),
                       user.hash.empty() ? "none" : "set", until.empty() ? "-" : until);
  }
}

}  // namespace

int RunUsers(const UsersOptions& options, std::istream& in, std::ostream& out, std::ostream& err) {
  using What = UsersOptions::What;
  auto users = users::UserFile::Read(options.file);
  if (!users) {
    err << "users: " << users.error() << '\n';
    return kExitCanNot;
  }
  const WallTime now = ReadClocks().wall;
  std::string done;
  switch (options.what) {
    case What::list:
      Print(*users, out);
      return kExitDone;
    case What::remove:
      if (!users->Remove(options.name)) {
        err << "users: there is no user " << Quoted(options.name) << " in " << options.file
            << "; 'baudgate users list' lists the users\n";
        return kExitUsage;
      }
      done = fmt::format("the user {} and the tokens of this user were removed", options.name);
      break;
    case What::token: {
      const auto until = now + std::chrono::hours(24) * options.days;
      const auto token = users->AddToken(options.name, until);
      if (!token) {
        err << "users: " << token.error() << '\n';
        return kExitUsage;
      }
      done = *token;
      err << "This token is shown once. It is valid until " << FormatWallTime(until).substr(0, 10)
          << ".\n";
      break;
    }
    case What::add: {
      const auto role = RoleNamed(options.role);
      if (!role) {
        err << "users: " << Quoted(options.role)
            << " is not a role; roles: viewer, operator, engineer, auditor\n";
        return kExitUsage;
      }
      const bool needs_password = !options.no_password && !options.name.starts_with('@');
      const auto password = needs_password ? Password(in, err) : std::string();
      if (!password) return kExitUsage;
      if (const Status status = users->Set(options.name, *role, *password); !status) {
        err << "users: " << status.error() << '\n';
        return kExitUsage;
      }
      done = fmt::format("{} has the role {}", options.name, options.role);
      break;
    }
  }
  users->DropOld(now);
  if (!Write(*users, options.file, err)) return kExitCanNot;
  out << done << '\n';
  return kExitDone;
}

int RunAudit(const JournalOptions& options, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err) {
  const config::Loaded loaded = config::LoadFile(options.config, catalog);
  if (!loaded.ok()) {
    PrintProblems(loaded.problems, err);
    return kExitBadConfiguration;
  }
  const auto folder =
      records::StateFolderOf(records::StatePlaces::Here(loaded.config.state), loaded.config.name);
  const auto check = audit::VerifyJournal(folder);
  if (!check) {
    err << "audit: " << check.error() << '\n';
    return kExitCanNot;
  }
  for (const audit::JournalRow& row : check->rows) {
    if (options.verify) break;
    const audit::SecurityEvent& event = row.event;
    if (options.json) {
      out << nlohmann::ordered_json{{"n", row.number},       {"time", row.time},
                                    {"kind", event.kind},    {"who", event.who},
                                    {"from", event.from},    {"what", event.what},
                                    {"result", event.result}}
                 .dump()
          << '\n';
    } else {
      out << fmt::format("{:>6}  {}  {:<8} {}{}  {}: {}\n", row.number, row.time, event.kind,
                         event.who, event.from.empty() ? "" : " from " + event.from, event.what,
                         event.result);
    }
  }
  for (const std::string& fault : check->faults) err << "audit: " << fault << '\n';
  if (options.verify && check->faults.empty()) {
    out << fmt::format("{} rows, none was changed; the hash of the last row is {}\n",
                       check->rows.size(), check->last_hash);
  }
  return check->faults.empty() ? kExitDone : 1;
}

}  // namespace baudgate::tools
