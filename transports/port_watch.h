// Says when a port that is absent, or that could not be opened, may have changed: its device file
// or a link to it has appeared, or its rights have changed. Hears it from inotify and calls the
// line's owner.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace baudgate {

class PortWatch {
 public:
  /// `on_change` is called from the loop, never from within a call. The io_context outlives the
  /// watch, which may be stopped from on_change, but not destroyed.
  PortWatch(asio::io_context& io, std::string port, std::function<void()> on_change);
  ~PortWatch() { Stop(); }
  PortWatch(const PortWatch&) = delete;
  PortWatch& operator=(const PortWatch&) = delete;

  /// Everything from now on is heard: look at the port after this, not before. False: this cannot
  /// be watched (a file system without such news, or no more watches): look from time to time.
  bool Start();
  void Stop();
  /// Started, and able to hear.
  bool watching() const { return running_ != nullptr; }

 private:
  struct Place {
    int watch = -1;
    std::string name;  // of the entry in the watched folder that matters
  };
  bool Renew();
  bool WatchEntry(const std::filesystem::path& path);
  void Read();
  bool Matters(std::size_t size) const;

  const std::string port_;
  const std::function<void()> on_change_;
  asio::posix::stream_descriptor inotify_;
  std::shared_ptr<char> running_;  // gone = stopped
  std::vector<Place> places_;
  alignas(8) std::array<char, 4096> events_{};
};

}  // namespace baudgate
