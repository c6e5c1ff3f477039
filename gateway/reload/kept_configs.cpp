// SPDX-License-Identifier: Apache-2.0
#include "gateway/reload/kept_configs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "gateway/state/whole_file.h"

namespace baudgate::reload {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

std::int64_t ToMillis(WallTime time) { return time.time_since_epoch() / 1ms; }

std::int64_t NumberIn(const Json& map, const char* key) {
  const auto found = map.find(key);
  return found != map.end() && found->is_number_integer() ? found->get<std::int64_t>() : 0;
}

std::string TextIn(const Json& map, const char* key) {
  const auto found = map.find(key);
  return found != map.end() && found->is_string() ? found->get<std::string>() : std::string();
}

WallTime TimeIn(const Json& map) {
  return WallTime(std::chrono::milliseconds(NumberIn(map, "time_ms")));
}

const Json* MapIn(const Json& map, const char* key) {
  const auto found = map.find(key);
  return found != map.end() && found->is_object() ? &*found : nullptr;
}

}  // namespace

KeptConfigs::KeptConfigs(fs::path folder) : folder_(std::move(folder)) { Read(); }

void KeptConfigs::Read() {
  const fs::path index = folder_ / "index.json";
  const auto text = ReadWhole(index);
  if (!text) return;
  const Json root = Json::parse(*text, nullptr, false);
  if (!root.is_object()) {
    std::error_code ignored;
    fs::rename(index, index.string() + ".bad", ignored);
    trouble_ = index.string() +
               " is damaged, and was put aside as .bad: what was confirmed, on trial " +
               "or taken back is not known any more, and the file runs";
    return;
  }
  const auto entries = root.find("entries");
  if (entries != root.end() && entries->is_array()) {
    for (const Json& one : *entries) {
      if (!one.is_object() || NumberIn(one, "number") <= 0) continue;
      index_.entries.push_back(
          {static_cast<std::uint64_t>(NumberIn(one, "number")), TimeIn(one), TextIn(one, "by")});
    }
  }
  index_.confirmed = static_cast<std::uint64_t>(NumberIn(root, "confirmed"));
  if (const Json* trial = MapIn(root, "trial")) {
    index_.trial = Trial{static_cast<std::uint64_t>(NumberIn(*trial, "number"))};
  }
  if (const Json* refused = MapIn(root, "refused")) {
    index_.refused = Refused{static_cast<std::uint64_t>(NumberIn(*refused, "number")),
                             TextIn(*refused, "why"), TimeIn(*refused)};
  }
}

fs::path KeptConfigs::PathOf(std::uint64_t number) const {
  return folder_ / fmt::format("{:06}.yaml", number);
}

Result<std::string> KeptConfigs::TextOf(std::uint64_t number) const {
  auto text = ReadWhole(PathOf(number));
  if (!text) return Error{PathOf(number).string() + ": can not be read"};
  return *std::move(text);
}

std::optional<std::string> KeptConfigs::confirmed_text() const {
  auto text = TextOf(index_.confirmed);
  if (!text) return std::nullopt;
  return *std::move(text);
}

std::optional<std::uint64_t> KeptConfigs::CopyInPlaceOf(const std::string& text) const {
  const std::uint64_t unwanted = trial() != 0 ? trial() : refused();
  if (unwanted == 0 || index_.confirmed == 0) return std::nullopt;
  const auto refused_text = TextOf(unwanted);
  if (!refused_text || *refused_text != text) return std::nullopt;
  return index_.confirmed;
}

Status KeptConfigs::Add(const std::string& text, std::string by, WallTime now, bool trial) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) return Error{folder_.string() + ": " + error.message()};
  Index next = index_;
  const std::uint64_t number = next.entries.empty() ? 1 : next.entries.back().number + 1;
  if (const int failed = WriteWhole(PathOf(number), text); failed != 0) {
    return Error{PathOf(number).string() + ": " + std::strerror(failed)};
  }
  next.entries.push_back({number, now, std::move(by)});
  next.trial.reset();
  next.refused.reset();
  if (trial) {
    next.trial = Trial{number};
  } else {
    next.confirmed = number;
  }
  return Write(next);
}

Status KeptConfigs::Confirm() {
  if (!index_.trial) return {};
  Index next = index_;
  next.confirmed = next.trial->number;
  next.trial.reset();
  return Write(next);
}

Status KeptConfigs::Refuse(std::string why, WallTime now) {
  if (!index_.trial) return {};
  Index next = index_;
  next.refused = Refused{next.trial->number, std::move(why), now};
  next.trial.reset();
  return Write(next);
}

/// Beside the last ones those that are still wanted.
void KeptConfigs::Drop(Index& index) const {
  std::size_t left = index.entries.size();
  std::erase_if(index.entries, [&](const KeptEntry& entry) {
    const bool wanted = entry.number == index.confirmed ||
                        (index.trial && entry.number == index.trial->number) ||
                        (index.refused && entry.number == index.refused->number);
    if (left <= kMost || wanted) return false;
    --left;
    return true;
  });
}

Status KeptConfigs::Write(const Index& index) {
  Index next = index;
  Drop(next);
  Json root;
  Json& entries = root["entries"] = Json::array();
  for (const KeptEntry& entry : next.entries) {
    entries.push_back(
        {{"number", entry.number}, {"time_ms", ToMillis(entry.time)}, {"by", entry.by}});
  }
  root["confirmed"] = next.confirmed;
  root["trial"] = next.trial ? Json{{"number", next.trial->number}} : Json(nullptr);
  root["refused"] = next.refused ? Json{{"number", next.refused->number},
                                        {"why", next.refused->why},
                                        {"time_ms", ToMillis(next.refused->time)}}
                                 : Json(nullptr);
  const fs::path file = folder_ / "index.json";
  const std::string text = root.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  if (const int failed = WriteWhole(file, text); failed != 0) {
    return Error{file.string() + ": " + std::strerror(failed)};
  }
  for (const KeptEntry& entry : index.entries) {
    if (std::ranges::find(next.entries, entry.number, &KeptEntry::number) == next.entries.end()) {
      std::error_code ignored;
      fs::remove(PathOf(entry.number), ignored);
    }
  }
  index_ = std::move(next);
  return {};
}

}  // namespace baudgate::reload
