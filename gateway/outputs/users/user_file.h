// `UserFile` is the content of the users file: users with their roles, password hashes and tokens.
// `baudgate users` changes the file, and `UserDirectory` reads it for the running gateway.
//
//   user anna operator $7$CU..../....fJyi…
//   user @scada operator -                          every member of the system's group scada
//   token anna 2027-11-30T00:00:00.000Z 5e884898da…
//
// A password is stored as its scrypt hash by libcrypt, see crypt(5); "-": the user has no password.
// A token has 256 random bits and is stored as its SHA-256 digest.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/role.h"
#include "gateway/base/time.h"

namespace baudgate::users {

inline constexpr const char* kDefaultFile = "/etc/baudgate/users";

struct User {
  std::string name;
  Role role = Role::viewer;
  std::string hash{};  ///< scrypt hash of the password; empty: the user has no password
};

struct Token {
  std::string user;
  WallTime until{};
  std::string digest;  ///< Sha256Hex of the token
};

class UserFile {
 public:
  static constexpr std::size_t kShortestPassword = 8;
  static constexpr std::size_t kLongestPassword = 256;

  /// An error names the line and the remedy.
  static Result<UserFile> Parse(std::string_view text);
  /// Returns the content of the file. A file that does not exist has no users. The file must be
  /// trusted (gateway/base/trusted_file.h) and must not be readable for users outside its group.
  static Result<UserFile> Read(const std::filesystem::path& file);
  std::string Text() const;

  /// Adds a user, or changes the role and password of a user. `password` empty: no password.
  Status Set(const std::string& name, Role role, std::string_view password);
  bool Remove(const std::string& name);
  /// Makes a token of the user, which ends at `until`. Returns the token, which is not stored. An
  /// error: there is no such user.
  Result<std::string> AddToken(const std::string& name, WallTime until);
  /// Removes tokens that have ended.
  void DropOld(WallTime now);

  const User* Find(std::string_view name) const;
  const std::vector<User>& users() const { return users_; }
  const std::vector<Token>& tokens() const { return tokens_; }

 private:
  std::vector<User> users_;
  std::vector<Token> tokens_;
};

/// True if `password` has this scrypt hash. Takes about a tenth of a second and 32 MiB.
bool HasHash(std::string_view password, const std::string& hash);

// `UserDirectory` answers who a client is. It reads the users file again when the content, owner or
// mode of the file has changed, and looks for changes at most once a second. While the file cannot
// be used, all logins of users fail, and Trouble says why. Any thread may call it; the time is an
// argument.
class UserDirectory {
 public:
  /// `file` empty: the gateway has no users.
  void SetFile(const std::string& file);
  bool is_used() const;
  /// Returns why the file cannot be used, as a sentence with the remedy; empty: it can.
  std::string Trouble(Instant now);

  /// How a user has logged in. `proof`: the hash of the password, or the digest of the token.
  struct Login {
    std::string user;
    std::string proof;
  };
  struct Known {
    User user;
    Login login;
  };
  /// Checks a password. Takes about a tenth of a second, also for an unknown user.
  std::optional<Known> ByPassword(std::string_view name, std::string_view password, Instant now);
  std::optional<Known> ByToken(std::string_view token, const Now& now);
  /// Returns the role of a user of this machine: by name, else the last role, in the order of
  /// Role, of the groups that the users file lists as "@group". A user who is not listed is a
  /// viewer.
  Role OfSystemUser(const std::string& name, std::span<const gid_t> groups, Instant now);
  /// Returns the present role of a user who has logged in. Empty: the user was removed, the
  /// password was changed, or the token was removed or has ended.
  std::optional<Role> RoleOf(const Login& login, const Now& now);

 private:
  void Refresh(Instant now) BAUDGATE_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::string path_ BAUDGATE_GUARDED_BY(mutex_);
  UserFile file_ BAUDGATE_GUARDED_BY(mutex_);
  std::string trouble_ BAUDGATE_GUARDED_BY(mutex_);
  /// State of the file that was read: inode, size, times, and whether it could be trusted.
  std::string seen_ BAUDGATE_GUARDED_BY(mutex_);
  Instant looked_ BAUDGATE_GUARDED_BY(mutex_) = Instant::min();
};

}  // namespace baudgate::users
