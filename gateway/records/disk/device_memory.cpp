// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/device_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "gateway/base/system_trouble.h"
#include "gateway/base/whole_file.h"
#include "gateway/records/disk/state_folder.h"

namespace baudgate::records {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr std::size_t kLongestMemory = 4096;

std::string WordOf(const Json& map, const char* key) {
  const auto found = map.find(key);
  return found != map.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace

DeviceMemory::DeviceMemory(fs::path file, const config::Config& config, Tell warn, Tell trouble)
    : file_(std::move(file)),
      warn_(std::move(warn)),
      trouble_(std::move(trouble)),
      keys_(KeysOf(config)),
      memories_(Read()),
      worker_("state", [this](bool last) {
        WriteChanges();
        return failing_ && !last ? ReadClocks().instant + kAgain : kWhenWoken;
      }) {
  worker_.Start();
}

std::vector<std::string> DeviceMemory::Read() {
  const MutexLock lock(mutex_);
  std::vector<std::string> memories(keys_.size());
  std::error_code error;
  if (!fs::exists(file_, error)) return memories;
  const Json root = Json::parse(ReadWhole(file_).value_or(std::string()), nullptr, false);
  const auto devices = root.is_object() ? root.find("devices") : root.end();
  if (!root.is_object() || devices == root.end() || !devices->is_array()) {
    fs::rename(file_, file_.string() + ".bad", error);
    warn_(fmt::format(
        "state: {} cannot be read and was renamed to {}.bad: the data learned from devices is lost",
        file_.string(), file_.filename().string()));
    return memories;
  }
  for (const Json& one : *devices) {
    if (!one.is_object()) continue;
    const std::string memory = WordOf(one, "memory");
    if (memory.size() > kLongestMemory) continue;
    const Key key{WordOf(one, "line"), WordOf(one, "device"), WordOf(one, "protocol"),
                  WordOf(one, "address"), WordOf(one, "profile")};
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      if (keys_[i] == key) memories[i] = memory;
    }
  }
  return memories;
}

std::vector<DeviceMemory::Key> DeviceMemory::KeysOf(const config::Config& config) {
  std::vector<Key> keys;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      keys.push_back({line.name, device.name, device.protocol, device.address, device.profile});
    }
  }
  return keys;
}

void DeviceMemory::OnReload(const config::Config& config) {
  std::vector<Key> keys = KeysOf(config);
  const MutexLock lock(mutex_);
  std::vector<std::string> memories(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const auto was = std::ranges::find(keys_, keys[i]);
    if (keys[i].device.empty() || was == keys_.end()) continue;
    memories[i] = memories_[static_cast<std::size_t>(was - keys_.begin())];
  }
  keys_ = std::move(keys);
  memories_ = std::move(memories);
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
    kept_ = Kept::waits;
  }
  worker_.Wake();
}

DeviceMemory::Kept DeviceMemory::kept() const {
  const MutexLock lock(mutex_);
  return kept_;
}

void DeviceMemory::WriteChanges() {
  std::string text;
  {
    const MutexLock lock(mutex_);
    if (!changed_ && !failing_) return;
    changed_ = false;
    text = Text();
  }
  Write(text);
  {
    const MutexLock lock(mutex_);
    if (!changed_) kept_ = failing_ ? Kept::no : Kept::yes;
  }
}

std::string DeviceMemory::Text() const {
  Json devices = Json::array();
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (memories_[i].empty()) continue;
    const Key& key = keys_[i];
    Json one = {{"line", key.line},
                {"device", key.device},
                {"protocol", key.protocol},
                {"address", key.address},
                {"profile", key.profile}};
    one["memory"] = memories_[i];
    devices.push_back(std::move(one));
  }
  const Json root = {{"version", kDevicesVersion}, {"devices", std::move(devices)}};
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void DeviceMemory::Write(const std::string& text) {
  const int error = WriteWhole(file_, text);
  const bool failed = std::exchange(failing_, error != 0);
  if (error != 0) {
    trouble_(
        fmt::format("cannot write {}: {}. The next start uses the old content of the file; later "
                    "changes are lost",
                    file_.string(), SystemTrouble(error)));
  } else if (failed) {
    trouble_({});
  }
}

}  // namespace baudgate::records
