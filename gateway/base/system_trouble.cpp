// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/system_trouble.h"

#include <fcntl.h>
#include <pwd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <fstream>
#include <future>
#include <memory>
#include <set>
#include <system_error>

#include "gateway/base/guarded.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/base/worker.h"

namespace baudgate {

std::string SystemTrouble(int error) {
  switch (error) {
    case EMFILE:
    case ENFILE:
      return "too many open files; raise LimitNOFILE of the service (ulimit -Hn)";
    case EFBIG:
      return "the file has reached the size limit; raise LimitFSIZE of the service (ulimit -f)";
    case ENOSPC:
    case EDQUOT:
      return "the disk is full; free some space";
    case EROFS:
      return "the file system is mounted read-only; check the disk (dmesg)";
    case EIO:
      return "the disk reports errors; check the disk (dmesg)";
    default:
      return std::generic_category().message(error);
  }
}

bool NoFileLeft() {
  const int file = ::open("/", O_RDONLY | O_PATH | O_CLOEXEC);
  if (file >= 0) ::close(file);
  return file < 0 && (errno == EMFILE || errno == ENFILE);
}

std::optional<std::size_t> MostFileBytes() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
    return std::nullopt;
  }
  return limit.rlim_cur;
}

namespace {

constexpr std::size_t kMostRemembered = 256;
constexpr Duration kPatience = 1s;

/// Returns the user's name; an empty text if the system has no such user, and nothing if the user
/// database cannot be read.
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

/// Calls AskSystem in a separate thread, because the user database may be on a server that does not
/// answer. Returns nothing after kPatience; or at once, if kMostUnderWay calls already wait.
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

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDevices = "/dev/";

std::string NameOf(const fs::path& process) {
  std::ifstream file(process / "comm");
  std::string name;
  std::getline(file, name);
  return name.empty() ? "a program" : Harmless(name);
}

}  // namespace

PortHolders FindHolders(const fs::path& root) {
  PortHolders holders;
  std::error_code error;
  for (const auto& process : fs::directory_iterator(root / "proc", error)) {
    const auto pid = ParseInteger<int>(process.path().filename().string());
    if (!pid) continue;
    std::error_code hidden;
    fs::directory_iterator files(process.path() / "fd", hidden);
    if (hidden == std::errc::permission_denied) holders.all_seen = false;
    std::set<std::string> held;
    for (; !hidden && files != fs::directory_iterator(); files.increment(hidden)) {
      std::error_code gone;
      const std::string target = fs::read_symlink(files->path(), gone).string();
      if (target.starts_with(kDevices)) held.insert(target.substr(kDevices.size()));
    }
    for (const std::string& port : held) {
      holders.by_port[port].push_back({*pid, NameOf(process.path())});
    }
  }
  for (auto& [port, programs] : holders.by_port) {
    std::ranges::sort(programs, {}, &PortHolders::Program::pid);
  }
  return holders;
}

std::string NameHolders(const std::string& port) {
  std::error_code none;
  const std::string path = fs::canonical(port, none).string();
  std::string names;
  if (path.starts_with(kDevices)) {
    PortHolders holders = FindHolders("/");
    for (const auto& program : holders.by_port[path.substr(kDevices.size())]) {
      if (program.pid == getpid()) continue;
      names += (names.empty() ? "" : ", ") + program.name + ", pid " + std::to_string(program.pid);
    }
  }
  return names.empty() ? "find it with: fuser -v " + port : names;
}

}  // namespace baudgate
