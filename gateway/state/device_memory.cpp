// SPDX-License-Identifier: Apache-2.0
#include "gateway/state/device_memory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "gateway/state/versions.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr std::size_t kLongestMemory = 4096;

Json KeyOf(const config::Line& line, const config::Device& device) {
  return {{"line", line.name},
          {"device", device.name},
          {"protocol", device.protocol},
          {"address", device.address},
          {"profile", device.profile}};
}

std::string WordOf(const Json& map, const char* key) {
  const auto found = map.find(key);
  return found != map.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Whole or not at all, whenever the power fails. The error is errno's; 0: it is on the disk.
int WriteWhole(const fs::path& file, std::string_view text) {
  const fs::path part = file.string() + ".part";
  const int out = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640);
  if (out < 0) return errno;
  int error = 0;
  while (!text.empty() && error == 0) {
    const auto written = ::write(out, text.data(), text.size());
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    if (written < 0 && errno != EINTR) error = errno;
  }
  if (error == 0 && ::fsync(out) != 0) error = errno;
  if (::close(out) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(part.c_str(), file.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(part.c_str());
    return error;
  }
  const int folder = ::open(file.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder >= 0) {
    ::fsync(folder);
    ::close(folder);
  }
  return 0;
}

}  // namespace

DeviceMemory::DeviceMemory(fs::path file, const config::Config& config,
                           std::function<void(const std::string&)> warn)
    : file_(std::move(file)), warn_(std::move(warn)) {
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) places_.push_back({&line, &device});
  }
  Read();
  thread_ = std::thread([this] { Run(); });
}

DeviceMemory::~DeviceMemory() {
  {
    const MutexLock lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void DeviceMemory::Read() {
  const MutexLock lock(mutex_);
  memories_.resize(places_.size());
  std::error_code error;
  if (!fs::exists(file_, error)) return;
  std::ifstream in(file_, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const Json root = Json::parse(text, nullptr, false);
  const auto devices = root.is_object() ? root.find("devices") : root.end();
  if (!root.is_object() || devices == root.end() || !devices->is_array()) {
    fs::rename(file_, file_.string() + ".bad", error);
    warn_(
        fmt::format("state: {} can not be read and is {}.bad now: what was remembered "
                    "of devices is lost",
                    file_.string(), file_.filename().string()));
    return;
  }
  for (const Json& one : *devices) {
    if (!one.is_object()) continue;
    const std::string memory = WordOf(one, "memory");
    if (memory.size() > kLongestMemory) continue;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const Json key = KeyOf(*places_[i].line, *places_[i].device);
      bool same = true;
      for (const auto& [name, value] : key.items()) {
        same = same && WordOf(one, name.c_str()) == value.get<std::string>();
      }
      if (same) memories_[i] = memory;
    }
  }
}

std::string DeviceMemory::Of(std::uint32_t device) const {
  const MutexLock lock(mutex_);
  return memories_[device];
}

void DeviceMemory::Set(std::uint32_t device, std::string memory) {
  if (memory.size() > kLongestMemory) return;
  {
    const MutexLock lock(mutex_);
    if (memories_[device] == memory) return;
    memories_[device] = std::move(memory);
    changed_ = true;
  }
  wake_.notify_one();
}

void DeviceMemory::Run() {
  pthread_setname_np(pthread_self(), "state");
  while (true) {
    std::string text;
    bool last = false;
    {
      MutexLock lock(mutex_);
      while (!stop_ && !changed_) lock.Wait(wake_);
      last = stop_;
      if (!changed_ && !failing_) return;
      changed_ = false;
      text = Text();
    }
    Write(text);
    if (last) return;
  }
}

std::string DeviceMemory::Text() const {
  Json devices = Json::array();
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (memories_[i].empty()) continue;
    Json one = KeyOf(*places_[i].line, *places_[i].device);
    one["memory"] = memories_[i];
    devices.push_back(std::move(one));
  }
  const Json root = {{"version", kDevicesVersion}, {"devices", std::move(devices)}};
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void DeviceMemory::Write(const std::string& text) {
  const int error = WriteWhole(file_, text);
  if (error == 0) {
    failing_ = false;
  } else if (!std::exchange(failing_, true)) {
    warn_(
        fmt::format("state: can not write {}: {}; what was learned of devices is kept with the "
                    "next change",
                    file_.string(), std::strerror(error)));
  }
}

}  // namespace baudgate
