// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/user_name.h"

#include <pwd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/base/worker.h"

namespace baudgate {
namespace {

constexpr std::size_t kMostRemembered = 256;
constexpr Duration kPatience = 1s;

/// An empty name: the system knows no such user. Empty: the users cannot be read.
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

/// The users may be those of a server that does not answer: nothing then, after kPatience. So many
/// calls may hang at once; no further one is begun.
std::optional<std::string> AskInTime(uid_t user) {
  static std::atomic<int> under_way = 0;
  constexpr int kMostUnderWay = 4;
  if (++under_way > kMostUnderWay) {
    --under_way;
    return std::nullopt;
  }
  auto asked = std::make_shared<std::promise<std::optional<std::string>>>();
  auto name = asked->get_future();
  const Status begun = StartDetached("user names", [asked, user] {
    asked->set_value(AskSystem(user));
    --under_way;
  });
  if (!begun) --under_way;
  const bool known = begun && name.wait_for(kPatience) == std::future_status::ready;
  return known ? name.get() : std::nullopt;
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
  const auto name = AskInTime(user);
  if (!name) return remembered.Get(user);
  if (name->empty()) return std::to_string(user);
  remembered.Put(user, *name);
  return *name;
}

}  // namespace baudgate
