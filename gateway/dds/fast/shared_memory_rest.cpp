// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/shared_memory_rest.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::dds {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "fastrtps_";
constexpr std::string_view kPort = "port";
constexpr std::size_t kSegmentDigits = 16;

/// The owner's (exclusive) lock, and those of others at a port (shared).
constexpr std::string_view kLocks[] = {"_el", "_sl"};

bool AllOf(std::string_view text, std::string_view allowed) {
  return !text.empty() && text.find_first_not_of(allowed) == std::string_view::npos;
}

/// fastrtps_50e7bc0f1d2b4149, fastrtps_port7410
bool IsSegmentOrPort(std::string_view name) {
  if (!name.starts_with(kPrefix)) return false;
  name.remove_prefix(kPrefix.size());
  if (name.size() == kSegmentDigits && AllOf(name, "0123456789abcdef")) return true;
  return name.starts_with(kPort) && AllOf(name.substr(kPort.size()), "0123456789");
}

/// A lock file that was ours to lock, and is as long as this lives; removed by Remove.
class FreeLock {
 public:
  explicit FreeLock(fs::path path)
      : path_(std::move(path)),
        descriptor_(::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK)) {}
  ~FreeLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  FreeLock(const FreeLock&) = delete;
  FreeLock& operator=(const FreeLock&) = delete;

  bool exists() const { return descriptor_ >= 0; }
  bool Take() const {
    struct stat seen {};
    if (::fstat(descriptor_, &seen) != 0 || !S_ISREG(seen.st_mode)) return false;
    if (seen.st_uid != ::geteuid()) return false;
    const auto changed =
        std::chrono::seconds(seen.st_mtim.tv_sec) + std::chrono::nanoseconds(seen.st_mtim.tv_nsec);
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return now - changed > kLockTaken && ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0;
  }
  std::size_t Remove() const { return exists() && ::unlink(path_.c_str()) == 0 ? 1 : 0; }

 private:
  fs::path path_;
  int descriptor_;
};

std::size_t RemoveRestOf(const fs::path& directory, const std::string& name) {
  const FreeLock owner(directory / (name + std::string(kLocks[0])));
  const FreeLock others(directory / (name + std::string(kLocks[1])));
  // Without any lock file nothing proves that the owner has ended.
  if (!owner.exists() && !others.exists()) return 0;
  if (owner.exists() && !owner.Take()) return 0;
  if (others.exists() && !others.Take()) return 0;
  std::size_t removed = ::unlink((directory / name).c_str()) == 0 ? 1 : 0;
  if (::unlink((directory / ("sem." + name + "_mutex")).c_str()) == 0) ++removed;
  return removed + owner.Remove() + others.Remove();
}

}  // namespace

std::size_t RemoveSharedMemoryRest(const fs::path& directory) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    std::string name = entry.path().filename().string();
    for (const std::string_view lock : kLocks) {
      if (!name.ends_with(lock)) continue;
      name.resize(name.size() - lock.size());
      break;
    }
    if (IsSegmentOrPort(name)) names.push_back(std::move(name));
  }
  std::ranges::sort(names);
  const auto repeated = std::ranges::unique(names);
  names.erase(repeated.begin(), repeated.end());
  std::size_t removed = 0;
  for (const std::string& name : names) removed += RemoveRestOf(directory, name);
  return removed;
}

}  // namespace baudgate::dds
