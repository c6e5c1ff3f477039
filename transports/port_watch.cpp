// One inotify descriptor on the folders of the port's path: where the port is a link, on those of
// its target as well; where a folder is missing, on the nearest one above it that exists.
// SPDX-License-Identifier: Apache-2.0
#include "transports/port_watch.h"

#include <sys/inotify.h>
#include <sys/vfs.h>

#include <algorithm>
#include <asio/buffer.hpp>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

namespace baudgate {
namespace {

namespace fs = std::filesystem;

/// As many links as a path may have; more is a circle.
constexpr int kMostLinks = 8;
constexpr std::uint32_t kNews =
    IN_CREATE | IN_MOVED_TO | IN_ATTRIB | IN_DELETE_SELF | IN_MOVE_SELF | IN_ONLYDIR;

/// File systems whose changes come from elsewhere than this kernel's calls: proc, sysfs, NFS, CIFS,
/// SMB2, 9P, FUSE.
bool TellsChanges(const fs::path& folder) {
  struct statfs info {};
  if (statfs(folder.c_str(), &info) != 0) return false;
  constexpr std::array<std::uint32_t, 7> kSilent = {0x9FA0,     0x62656572, 0x6969,    0xFF534D42,
                                                    0xFE534D42, 0x01021997, 0x65735546};
  const auto type = static_cast<std::uint32_t>(info.f_type);
  return std::find(kSilent.begin(), kSilent.end(), type) == kSilent.end();
}

}  // namespace

PortWatch::PortWatch(asio::io_context& io, std::string port, std::function<void()> on_change)
    : port_(std::move(port)), on_change_(std::move(on_change)), inotify_(io) {}

bool PortWatch::Start() {
  Stop();
  const int fd = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (fd < 0) return false;
  std::error_code error;
  inotify_.assign(fd, error);
  if (error) ::close(fd);
  if (error || !Renew()) {
    Stop();
    return false;
  }
  running_ = std::make_shared<char>();
  Read();
  return true;
}

void PortWatch::Stop() {
  running_.reset();
  std::error_code ignored;
  inotify_.close(ignored);
  places_.clear();
}

/// Follows the path again: a link may lead elsewhere, a folder may have come or gone.
bool PortWatch::Renew() {
  const std::vector<Place> before = std::exchange(places_, {});
  std::error_code error;
  fs::path path = fs::absolute(port_, error).lexically_normal();
  bool watched = true;
  for (int links = 0; watched && links < kMostLinks; ++links) {
    watched = WatchEntry(path);
    const fs::path target = fs::read_symlink(path, error);
    if (error) break;
    path = (fs::weakly_canonical(path.parent_path(), error) / target).lexically_normal();
  }
  for (const Place& place : before) {
    const bool kept = std::any_of(places_.begin(), places_.end(),
                                  [&](const Place& now) { return now.watch == place.watch; });
    if (!kept) inotify_rm_watch(inotify_.native_handle(), place.watch);
  }
  return watched;
}

bool PortWatch::WatchEntry(const fs::path& path) {
  fs::path entry = path;
  for (;;) {
    const fs::path folder = entry.parent_path();
    const int watch = inotify_add_watch(inotify_.native_handle(), folder.c_str(), kNews);
    const int reason = errno;
    if (watch >= 0) {
      if (!TellsChanges(folder)) return false;
      places_.push_back({watch, entry.filename().string()});
      std::error_code error;
      // What came between the attempt further down and this one would go unheard.
      if (entry == path || !fs::is_directory(entry, error)) return true;
      entry = path;
      continue;
    }
    const bool missing = reason == ENOENT || reason == ENOTDIR;
    if (!missing || folder == entry) return false;
    entry = folder;
  }
}

void PortWatch::Read() {
  inotify_.async_read_some(
      asio::buffer(events_),
      [this, running = std::weak_ptr(running_)](const std::error_code& error, std::size_t size) {
        if (running.expired()) return;
        if (!error && !Matters(size)) return Read();
        if (error || !Renew()) {
          Stop();
        } else {
          Read();
        }
        on_change_();
      });
}

bool PortWatch::Matters(std::size_t size) const {
  for (std::size_t at = 0; at + sizeof(inotify_event) <= size;) {
    inotify_event event{};
    std::memcpy(&event, events_.data() + at, sizeof event);
    const char* name = event.len > 0 ? events_.data() + at + sizeof event : "";
    const bool of_folder = (event.mask & (IN_DELETE_SELF | IN_MOVE_SELF | IN_IGNORED)) != 0;
    const bool ours =
        std::any_of(places_.begin(), places_.end(), [&, watch = event.wd](const Place& place) {
          return place.watch == watch && (of_folder || place.name == name);
        });
    if (ours || (event.mask & IN_Q_OVERFLOW) != 0) return true;
    at += sizeof event + event.len;
  }
  return false;
}

}  // namespace baudgate
