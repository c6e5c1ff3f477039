// SPDX-License-Identifier: Apache-2.0
#include "transports/port_keeper.h"

#include <sys/inotify.h>
#include <sys/vfs.h>

#include <asio/buffer.hpp>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace baudgate::transports {

// PortWatch has one inotify descriptor. It watches the folder of the port's path; if the port is a
// link, also the folder of its target; if a folder is missing, its nearest existing parent.

namespace {

namespace fs = std::filesystem;

/// The maximum number of links to follow; more links form a circle.
constexpr int kMostLinks = 8;
constexpr std::uint32_t kNews =
    IN_CREATE | IN_MOVED_TO | IN_ATTRIB | IN_DELETE_SELF | IN_MOVE_SELF | IN_ONLYDIR;

/// Returns false for file systems that change without a call to this kernel, because inotify does
/// not report such changes: proc, sysfs, NFS, CIFS, SMB2, 9P, FUSE. Also false if the kind of file
/// system cannot be read.
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
  watched_.clear();
}

/// Sets the watches again, because a link may have changed, or a folder was made or removed.
bool PortWatch::Renew() {
  const std::vector<WatchedFolder> before = std::exchange(watched_, {});
  std::error_code error;
  fs::path path = fs::absolute(port_, error).lexically_normal();
  bool watched = true;
  for (int links = 0; watched && links < kMostLinks; ++links) {
    watched = WatchEntry(path);
    const fs::path target = fs::read_symlink(path, error);
    if (error) break;
    path = (fs::weakly_canonical(path.parent_path(), error) / target).lexically_normal();
  }
  for (const WatchedFolder& place : before) {
    const bool kept = std::any_of(watched_.begin(), watched_.end(), [&](const WatchedFolder& now) {
      return now.watch == place.watch;
    });
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
      watched_.push_back({watch, entry.filename().string()});
      std::error_code error;
      // If a missing folder was created before its parent was watched, inotify reports nothing, so
      // the folder is tried again.
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
    const bool ours = std::any_of(
        watched_.begin(), watched_.end(), [&, watch = event.wd](const WatchedFolder& place) {
          return place.watch == watch && (of_folder || place.name == name);
        });
    if (ours || (event.mask & IN_Q_OVERFLOW) != 0) return true;
    at += sizeof event + event.len;
  }
  return false;
}

namespace {

/// The interval at which a missing port is checked if it cannot be watched.
constexpr Duration kLookForPort = 500ms;

}  // namespace

PortKeeper::PortKeeper(asio::io_context& io, std::string port, std::function<void()> open)
    : port_(std::move(port)),
      network_(config::IsNetworkPort(port_)),
      open_(std::move(open)),
      timer_(io),
      watch_(io, port_, [this] { OnPortChange(); }),
      ladder_(static_cast<std::uint32_t>(std::hash<std::string>{}(port_))) {}

void PortKeeper::Stop() {
  waiting_.reset();
  timer_.cancel();
  watch_.Stop();
  ladder_.Reset();
  told_.clear();
}

void PortKeeper::OnOpened() {
  if (!network_) return Stop();
  waiting_.reset();
  timer_.cancel();
}

bool PortKeeper::OnDown(const std::string& reason) {
  if (!network_ && !told_.contains(reason)) told_.clear();
  const bool news = told_.insert(reason).second;
  // The watch is started before the port is checked, so that no change between the two is lost.
  const bool watching = !network_ && (watch_.watching() || watch_.Start());
  if (!IsMissing()) {
    TryIn(ladder_.Next());
  } else {
    ladder_.Reset();
    if (!watching) TryIn(kLookForPort);
  }
  return news;
}

void PortKeeper::TryIn(Duration wait) {
  waiting_ = std::make_shared<char>();
  timer_.expires_after(wait);
  timer_.async_wait([this, waiting = std::weak_ptr(waiting_)](const asio::error_code& error) {
    if (!error && !waiting.expired()) Try();
  });
}

void PortKeeper::OnPortChange() {
  waiting_.reset();
  timer_.cancel();
  ladder_.Reset();
  Try();
}

/// Opens the port unless it is missing; a missing port has been reported already.
void PortKeeper::Try() {
  if (!IsMissing()) return open_();
  ladder_.Reset();
  if (!watch_.watching()) TryIn(kLookForPort);
}

bool PortKeeper::IsMissing() const {
  std::error_code error;
  return !network_ && !std::filesystem::exists(port_, error);
}

namespace {

/// The maximum number of received bytes that wait for the server's thread; further bytes are
/// dropped. A pty can deliver bytes faster than a busy server takes them.
constexpr std::size_t kMostUnheard = 64 * 1024;

}  // namespace

PortThread::PortThread(asio::io_context& server, const std::string& path, const MakePort& make,
                       Owner& owner)
    : server_(server),
      owner_(owner),
      port_(make(loop_.io(), *this)),
      keeper_(loop_.io(), path, [this] { port_->Open(); }) {
  loop_.Start();
}

void PortThread::Start() {
  running_ = std::make_shared<char>();
  asio::post(loop_.io(), [this] { port_->Open(); });
}

void PortThread::Stop() {
  loop_.Stop([this] {
    keeper_.Stop();
    port_->Close();
  });
  running_.reset();
}

void PortThread::Send(Bytes bytes) {
  asio::post(loop_.io(), [this, bytes = std::move(bytes)] {
    if (port_->is_open()) port_->Send(bytes);
  });
}

void PortThread::OnOpened() {
  keeper_.OnOpened();
  Tell([this, description = port_->Describe()] { owner_.OnOpened(description); });
}

void PortThread::Down(const std::string& reason) {
  const bool is_news = keeper_.OnDown(reason);
  Tell([this, reason, is_news] { owner_.OnDown(reason, is_news); });
}

void PortThread::OnBytes(View bytes) {
  if (unheard_ + bytes.size() > kMostUnheard) return;
  unheard_ += bytes.size();
  Tell([this, at = ReadClocks().instant, bytes = Bytes(bytes.begin(), bytes.end())] {
    unheard_ -= bytes.size();
    owner_.OnBytes(bytes, at);
  });
}

}  // namespace baudgate::transports
