// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/users.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/file.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
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

/// Reads a line from the terminal without showing it. Ctrl-C and Ctrl-D end the input, and the
/// terminal gets its settings back. Empty: the input was ended.
std::optional<std::string> AskHidden(const char* prompt, std::ostream& err) {
  termios before{};
  if (::tcgetattr(STDIN_FILENO, &before) != 0) return std::nullopt;
  termios hidden = before;
  hidden.c_lflag &= ~static_cast<tcflag_t>(ECHO | ISIG);
  err << prompt << std::flush;
  ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &hidden);
  std::string text;
  char c = 0;
  while (::read(STDIN_FILENO, &c, 1) == 1 && c != '\n') text += c;
  ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before);
  err << '\n';
  constexpr char kCtrlC = 3;
  if (c != '\n' || text.find(kCtrlC) != std::string::npos) return std::nullopt;
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

/// Writes the file. A new file gets the group `baudgate` if there is one, so that the service can
/// read it.
bool Write(const users::UserFile& users, const std::string& file, std::ostream& err) {
  const bool existed = ::access(file.c_str(), F_OK) == 0;
  const int error = WriteWhole(file, users.Text());
  if (error != 0) {
    err << "users: " << file << " cannot be written: " << SystemTrouble(error);
    const auto folder = std::filesystem::path(file).parent_path().string();
    if (error == ENOENT) err << "; make the folder: sudo install -d " << folder;
    err << '\n';
    return false;
  }
  const group* const service = existed ? nullptr : ::getgrnam("baudgate");
  if (service != nullptr && ::chown(file.c_str(), static_cast<uid_t>(-1), service->gr_gid) != 0) {
    err << "users: the gateway may not be able to read " << file << "; run: sudo chgrp baudgate "
        << file << '\n';
  }
  return true;
}

/// Holds the lock of the users file, so that two commands do not undo each other's changes.
class Lock {
 public:
  explicit Lock(const std::string& file)
      : descriptor_(
            ::open((file + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600)) {
    if (descriptor_ >= 0) (void)::flock(descriptor_, LOCK_EX);
  }
  ~Lock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  const int descriptor_;
};

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
  const auto role = RoleNamed(options.role);
  std::optional<std::string> password = std::string();
  if (options.what == What::add) {
    if (!role) {
      err << "users: " << Quoted(options.role)
          << " is not a role; roles: viewer, operator, engineer, auditor\n";
      return kExitUsage;
    }
    const bool is_group = options.name.starts_with('@');
    if (is_group && ::getgrnam(options.name.c_str() + 1) == nullptr) {
      err << "users: this system has no group " << Quoted(options.name.substr(1)) << '\n';
      return kExitUsage;
    }
    // Asked for before the file is locked and read, because a person takes time.
    if (!options.no_password && !is_group) password = Password(in, err);
    if (!password) return kExitUsage;
  }
  std::optional<Lock> lock;
  if (options.what != What::list) lock.emplace(options.file);
  auto users = users::UserFile::Read(options.file);
  if (!users) {
    err << "users: " << users.error() << '\n';
    return kExitCanNot;
  }
  const WallTime now = ReadClocks().wall;
  std::string done;
  std::string remark;  // printed before `done`
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
      remark = fmt::format("This token is shown once. It is valid until {}.\n",
                           FormatWallTime(until).substr(0, 10));
      break;
    }
    case What::add:
      if (const Status status = users->Set(options.name, *role, *password); !status) {
        err << "users: " << status.error() << '\n';
        return kExitUsage;
      }
      done = fmt::format("{} has the role {}", options.name, options.role);
      break;
  }
  users->DropOld(now);
  if (!Write(*users, options.file, err)) return kExitCanNot;
  err << remark;
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
    out << fmt::format("rows {} to {}: none was changed or is missing; the hash of row {} is {}\n",
                       check->rows.front().number, check->rows.back().number,
                       check->rows.back().number, check->last_hash);
  }
  return check->faults.empty() ? kExitDone : 1;
}

}  // namespace baudgate::tools
