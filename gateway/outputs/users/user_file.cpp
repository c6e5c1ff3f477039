// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/users/user_file.h"

#include <crypt.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/secrets.h"
#include "gateway/base/system_trouble.h"
#include "gateway/base/text.h"
#include "gateway/base/trusted_file.h"
#include "gateway/base/whole_file.h"

namespace baudgate::users {
namespace {

constexpr std::size_t kLongestName = 64;
constexpr std::size_t kTokenBytes = 32;
constexpr const char* kScrypt = "$7$";
constexpr unsigned long kCost = 6;  // N = 8192, r = 32: 32 MiB, a tenth of a second
/// Hash of no password, so that an unknown user takes the same time as a known one.
constexpr const char* kNobody =
    "$7$BU..../....b172m983Q1DvHrEDiAPnc0$yPpdNDC4HmpEVn/jVOGTXc5gQl79w7lpkJ/fuJaxe12";

std::string WhyNotName(std::string_view name) {
  const std::string_view plain = name.starts_with('@') ? name.substr(1) : name;
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::strchr("._-", c) != nullptr;
  };
  if (!plain.empty() && name.size() <= kLongestName && std::ranges::all_of(plain, fits)) return {};
  return Quoted(name) +
         " is not a name of a user: write letters, digits, '.', '_' and '-', at most 64";
}

std::string RoleError(std::string_view word) {
  return Quoted(word) + " is not a role; roles: viewer, operator, engineer, auditor";
}

/// Returns the number of the system's group of a user "@group".
std::optional<gid_t> GroupOf(const std::string& name) {
  if (!name.starts_with('@')) return std::nullopt;
  group found{};
  group* result = nullptr;
  std::vector<char> space(65536);  // a group with many members needs much space
  if (::getgrnam_r(name.c_str() + 1, &found, space.data(), space.size(), &result) != 0 ||
      result == nullptr) {
    return std::nullopt;
  }
  return result->gr_gid;
}

std::string HashOf(std::string_view password) {
  std::array<char, CRYPT_GENSALT_OUTPUT_SIZE> salt{};
  if (::crypt_gensalt_rn(kScrypt, kCost, nullptr, 0, salt.data(), salt.size()) == nullptr)
    return {};
  crypt_data data{};
  const char* const hash =
      ::crypt_rn(std::string(password).c_str(), salt.data(), &data, sizeof data);
  return hash == nullptr ? std::string() : std::string(hash);
}

}  // namespace

bool HasHash(std::string_view password, const std::string& hash) {
  if (password.find('\0') != std::string_view::npos) return false;  // crypt() would end there
  crypt_data data{};
  const char* const made =
      ::crypt_rn(std::string(password).c_str(), hash.c_str(), &data, sizeof data);
  return made != nullptr && SameSecret(made, hash);
}

Result<UserFile> UserFile::Parse(std::string_view text) {
  UserFile file;
  int number = 0;
  for (const std::string_view line : Split(text, '\n')) {
    ++number;
    std::vector<std::string> words;
    for (const std::string_view word : Split(Trim(line), ' ')) {
      if (!word.empty()) words.emplace_back(word);
    }
    if (words.empty() || words[0].starts_with('#')) continue;
    const auto wrong = [number](const std::string& why) {
      return Error{fmt::format("line {}: {}", number, why)};
    };
    if (words.size() != 4 || (words[0] != "user" && words[0] != "token")) {
      return wrong("is not 'user NAME ROLE HASH' or 'token NAME UNTIL DIGEST'");
    }
    if (std::string why = WhyNotName(words[1]); !why.empty()) return wrong(why);
    if (words[0] == "token") {
      const auto until = ParseWallTime(words[2]);
      if (!until) return wrong(until.error());
      if (file.Find(words[1]) == nullptr) return wrong("there is no user " + Quoted(words[1]));
      file.tokens_.push_back({words[1], *until, words[3]});
      continue;
    }
    const auto role = RoleNamed(words[2]);
    if (!role) return wrong(RoleError(words[2]));
    if (file.Find(words[1]) != nullptr) return wrong(Quoted(words[1]) + " is listed twice");
    file.users_.push_back({words[1], *role, words[3] == "-" ? std::string() : words[3]});
  }
  return file;
}

Result<UserFile> UserFile::Read(const std::filesystem::path& file) {
  const std::string name = "the users file " + file.string();
  if (const std::string why = WhyNotTrusted(file); !why.empty()) {
    return Error{name + " is not used: " + why};
  }
  struct stat its {};
  if (::stat(file.c_str(), &its) != 0) {
    if (errno == ENOENT) return UserFile();
    return Error{name + " cannot be read: " + SystemTrouble(errno)};
  }
  if ((its.st_mode & S_IRWXO) != 0) {
    return Error{name + " can be read or changed by every user; run: chmod o= " + file.string()};
  }
  const auto text = ReadWhole(file);
  if (!text) return Error{name + " cannot be read: " + SystemTrouble(errno)};
  auto parsed = Parse(*text);
  if (!parsed) return Error{name + ": " + parsed.error()};
  return parsed;
}

std::string UserFile::Text() const {
  std::string text = "# Users of baudgate: change this file with `baudgate users`.\n";
  for (const User& user : users_) {
    text += fmt::format("user {} {} {}\n", user.name, Name(user.role),
                        user.hash.empty() ? "-" : user.hash);
  }
  for (const Token& token : tokens_) {
    text += fmt::format("token {} {} {}\n", token.user, FormatWallTime(token.until), token.digest);
  }
  return text;
}

Status UserFile::Set(const std::string& name, Role role, std::string_view password) {
  if (std::string why = WhyNotName(name); !why.empty()) return Error{std::move(why)};
  if (!password.empty() &&
      (password.size() < kShortestPassword || password.size() > kLongestPassword)) {
    return Error{fmt::format("the password has {} characters; it needs {} to {}", password.size(),
                             kShortestPassword, kLongestPassword)};
  }
  if (password.find('\0') != std::string_view::npos) {
    return Error{"the password contains the character NUL; use another one"};
  }
  std::string hash = password.empty() ? std::string() : HashOf(password);
  if (!password.empty() && hash.empty()) {
    return Error{"libcrypt of this system makes no scrypt hashes; install libcrypt1 of Debian"};
  }
  const auto known = std::ranges::find(users_, name, &User::name);
  if (known == users_.end()) {
    users_.push_back({name, role, std::move(hash)});
  } else {
    *known = {name, role, std::move(hash)};
  }
  return {};
}

bool UserFile::Remove(const std::string& name) {
  std::erase_if(tokens_, [&](const Token& token) { return token.user == name; });
  return std::erase_if(users_, [&](const User& user) { return user.name == name; }) > 0;
}

Result<std::string> UserFile::AddToken(const std::string& name, WallTime until) {
  if (Find(name) == nullptr) {
    return Error{"there is no user " + Quoted(name) + "; add it with: baudgate users add " + name +
                 " --role viewer --no-password"};
  }
  std::string token = RandomHex(kTokenBytes);
  tokens_.push_back({name, until, Sha256Hex(token)});
  return token;
}

void UserFile::DropOld(WallTime now) {
  std::erase_if(tokens_, [now](const Token& token) { return token.until <= now; });
}

const User* UserFile::Find(std::string_view name) const {
  const auto found = std::ranges::find(users_, name, &User::name);
  return found == users_.end() ? nullptr : &*found;
}

void UserDirectory::SetFile(const std::string& file) {
  const MutexLock lock(mutex_);
  if (path_ == file) return;
  path_ = file;
  file_ = {};
  trouble_.clear();
  seen_.clear();
  looked_ = Instant::min();
}

bool UserDirectory::is_used() const {
  const MutexLock lock(mutex_);
  return !path_.empty();
}

void UserDirectory::Refresh(Instant now) {
  constexpr Duration kLook = 1s;
  if (path_.empty() || (looked_ != Instant::min() && now - looked_ < kLook)) return;
  looked_ = now;
  struct stat its {};
  std::string seen = "absent";
  if (::stat(path_.c_str(), &its) == 0) {
    // The time of the status changes with owner and mode. The folders above the file have others.
    seen = fmt::format("{} {} {}.{} {}.{} {}", its.st_ino, its.st_size, its.st_mtim.tv_sec,
                       its.st_mtim.tv_nsec, its.st_ctim.tv_sec, its.st_ctim.tv_nsec,
                       WhyNotTrusted(path_));
  }
  if (seen == seen_ && (trouble_.empty() || seen == "absent")) return;
  seen_ = std::move(seen);
  auto read = UserFile::Read(path_);
  std::string trouble = read ? std::string() : read.error();
  if (read && read->users().empty()) {
    trouble =
        "the users file " + path_ +
        " has no users, so nobody can log in; add one: baudgate users add NAME --role engineer";
  }
  file_ = read ? std::move(*read) : UserFile();
  if (std::exchange(trouble_, trouble) != trouble && !trouble.empty()) log::Warn("{}", trouble);
}

std::string UserDirectory::Trouble(Instant now) {
  const MutexLock lock(mutex_);
  Refresh(now);
  return trouble_;
}

std::optional<UserDirectory::Known> UserDirectory::ByPassword(std::string_view name,
                                                              std::string_view password,
                                                              Instant now) {
  std::optional<User> user;
  {
    const MutexLock lock(mutex_);
    Refresh(now);
    if (const User* const found = file_.Find(name)) user = *found;
  }
  const bool has_password = user && !user->hash.empty();
  const bool right = HasHash(password, has_password ? user->hash : kNobody);
  if (!right || !has_password) return std::nullopt;
  return Known{*user, {user->name, user->hash}};
}

std::optional<UserDirectory::Known> UserDirectory::ByToken(std::string_view token, const Now& now) {
  const std::string digest = Sha256Hex(token);
  const MutexLock lock(mutex_);
  Refresh(now.instant);
  for (const Token& one : file_.tokens()) {
    if (now.wall >= one.until || !SameSecret(one.digest, digest)) continue;
    const User* const user = file_.Find(one.user);
    if (user != nullptr) return Known{*user, {user->name, one.digest}};
  }
  return std::nullopt;
}

Role UserDirectory::OfSystemUser(const std::string& name, std::span<const gid_t> groups,
                                 Instant now) {
  std::vector<User> listed;
  {
    const MutexLock lock(mutex_);
    Refresh(now);
    if (const User* const user = file_.Find(name)) return user->role;
    listed = file_.users();
  }
  // Groups are looked up each time, because a group can be made after it was listed in the file.
  Role role = Role::viewer;
  for (const User& user : listed) {
    const auto group = GroupOf(user.name);
    if (group && std::ranges::find(groups, *group) != groups.end())
      role = std::max(role, user.role);
  }
  return role;
}

std::optional<Role> UserDirectory::RoleOf(const Login& login, const Now& now) {
  const MutexLock lock(mutex_);
  Refresh(now.instant);
  const User* const user = file_.Find(login.user);
  if (user == nullptr) return std::nullopt;
  const auto is_it = [&](const Token& token) {
    return token.user == login.user && token.digest == login.proof && now.wall < token.until;
  };
  const bool holds = (!user->hash.empty() && user->hash == login.proof) ||
                     std::ranges::any_of(file_.tokens(), is_it);
  return holds ? std::optional(user->role) : std::nullopt;
}

}  // namespace baudgate::users
