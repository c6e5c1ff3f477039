// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/user_name.h"

#include <pwd.h>

#include <cerrno>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "gateway/base/guarded.h"

namespace baudgate {
namespace {

constexpr std::size_t kMostRemembered = 256;

/// An empty name: the system knows no such user. Nothing: the users cannot be read.
std::optional<std::string> AskSystem(uid_t user) {
  constexpr std::size_t kLongest = 65'536;
  std::vector<char> texts(1024);
  passwd entry{};
  passwd* found = nullptr;
  int failed = ::getpwuid_r(user, &entry, texts.data(), texts.size(), &found);
  while (failed == ERANGE && texts.size() < kLongest) {
    texts.resize(2 * texts.size());
    failed = ::getpwuid_r(user, &entry, texts.data(), texts.size(), &found);
  }
  if (found != nullptr) return found->pw_name;
  return failed == 0 ? std::optional(std::string()) : std::nullopt;
}

class Remembered {
 public:
  void Put(uid_t user, const std::string& name) {
    const MutexLock lock(mutex_);
    if (names_.size() < kMostRemembered || names_.contains(user)) names_[user] = name;
  }
  std::string Get(uid_t user) {
    const MutexLock lock(mutex_);
    const auto found = names_.find(user);
    return found == names_.end() ? std::to_string(user) : found->second;
  }

 private:
  Mutex mutex_;
  std::map<uid_t, std::string> names_ BAUDGATE_GUARDED_BY(mutex_){{0, "root"}};
};

}  // namespace

std::string NameOfUser(uid_t user) {
  static Remembered remembered;
  const auto name = AskSystem(user);
  if (!name) return remembered.Get(user);
  if (name->empty()) return std::to_string(user);
  remembered.Put(user, *name);
  return *name;
}

}  // namespace baudgate
