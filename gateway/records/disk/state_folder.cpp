// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/state_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <future>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <vector>

#include "gateway/base/system_trouble.h"
#include "gateway/base/trusted_file.h"
#include "gateway/base/whole_file.h"
#include "gateway/base/worker.h"
#include "gateway/records/disk/events_file.h"

namespace baudgate::records {
namespace {

constexpr const char* kSystemState = "/var/lib/baudgate";
namespace fs = std::filesystem;

struct Known {
  std::int64_t application;
  std::int64_t version;
};
/// The ids and versions of events.db, and of values-YYYYMMDD.db and trends.db
/// (gateway/records/history).
constexpr std::array<Known, 3> kKnown = {
    {{kEventsApplication, kEventsVersion}, {0x42477661, 1}, {0x42477472, 1}}};

/// The first bytes of an SQLite file, and positions in its head:
/// https://www.sqlite.org/fileformat.html, 1.3.
constexpr std::string_view kMagic = "SQLite format 3";
constexpr std::size_t kVersionAt = 60;
constexpr std::size_t kApplicationAt = 68;
constexpr std::size_t kHead = 72;

std::int64_t Big32(std::string_view bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    number = number << 8U | static_cast<unsigned char>(bytes[at + i]);
  }
  return number;
}

/// Returns application_id and version of a database; empty: the file is not a database. Only the
/// head is read, because years of history have a thousand files. If a log exists, which a killed
/// gateway leaves, SQLite reads the values.
std::optional<Known> VersionOf(const fs::path& file) {
  Database database(file.string(), Database::Mode::read);
  const auto head =
      database.is_open() ? database.Read(Database::Part::file, 0, kHead) : std::optional<Bytes>();
  if (!head || head->size() < kHead || !AsText(*head).starts_with(kMagic)) return std::nullopt;
  Known found{Big32(AsText(*head), kApplicationAt), Big32(AsText(*head), kVersionAt)};
  std::error_code error;
  const auto log = fs::file_size(file.string() + "-wal", error);
  if (error || log == 0) return found;
  const auto take = [&](const char* sql, std::int64_t& target) {
    const Value value = database.First(sql);
    if (const auto* number = std::get_if<std::int64_t>(&value)) target = *number;
  };
  take("PRAGMA application_id", found.application);
  take("PRAGMA user_version", found.version);
  return found;
}

std::int64_t DevicesVersionOf(const fs::path& file) {
  const auto root = nlohmann::json::parse(ReadWhole(file).value_or(std::string()), nullptr, false);
  if (!root.is_object()) return kDevicesVersion;
  const auto version = root.find("version");
  const bool whole = version != root.end() && version->is_number_integer();
  return whole ? version->get<std::int64_t>() : kDevicesVersion;
}

std::string Sentence(const fs::path& file, std::int64_t version, std::int64_t known) {
  return fmt::format(
      "{} was written by a newer baudgate (file version {}, this baudgate reads up to {}); the "
      "file was not changed. Start the newer baudgate, or set another folder in gateway.state",
      file.string(), version, known);
}

}  // namespace

std::int64_t KnownVersion(std::int64_t application) {
  const auto found = std::ranges::find(kKnown, application, &Known::application);
  return found == kKnown.end() ? 0 : found->version;
}

std::string NewerStateIn(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::directory_iterator one(folder, error), end; !error && one != end; one.increment(error)) {
    files.push_back(one->path());
  }
  std::ranges::sort(files);
  for (const fs::path& file : files) {
    if (file.filename() == "devices.json" || file.filename() == "clocks.json") {
      const std::int64_t version = DevicesVersionOf(file);
      if (version > kDevicesVersion) return Sentence(file, version, kDevicesVersion);
    }
    if (file.extension() != ".db") continue;
    const auto found = VersionOf(file);
    const std::int64_t known = found ? KnownVersion(found->application) : 0;
    if (known != 0 && found->version > known) return Sentence(file, found->version, known);
  }
  return {};
}

namespace {

namespace fs = std::filesystem;

constexpr mode_t kLockMode = 0644;
constexpr const char* kLock = "lock";

bool IsFile(int open, const fs::path& file) {
  struct stat its {};
  struct stat found {};
  return ::fstat(open, &its) == 0 && ::stat(file.c_str(), &found) == 0 &&
         its.st_dev == found.st_dev && its.st_ino == found.st_ino;
}

std::string HowToMake(const fs::path& folder, int error) {
  if (error == ENOTDIR || error == EEXIST)
    return "; a part of this path is a file: set another path in gateway.state";
  if (error != EACCES && error != EPERM) return {};
  const std::string user = NameOfUser(::geteuid());
  return fmt::format("; create the folder: sudo install -d -o {} {}", user, folder.string());
}

std::string Environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : value;
}

bool CanMakeSystemState() {
  const fs::path folder(kSystemState);
  std::error_code error;
  const fs::path asked = fs::exists(folder, error) ? folder : folder.parent_path();
  return ::access(asked.c_str(), W_OK | X_OK) == 0;
}

bool RoutesWrite(const config::Config& config) {
  const bool permitted =
      config.modbus.enabled && std::ranges::any_of(config.modbus.listen, [](const auto& listener) {
        return listener.permit != config::Permit::read;
      });
  return permitted && !config.modbus.routes.empty();
}

}  // namespace

bool CanWrite(const config::Config& config) {
  if (RoutesWrite(config)) return true;
  return std::ranges::any_of(config.lines, [](const config::Line& line) {
    if (line.ask == config::Ask::write || line.lend) return true;
    return std::ranges::any_of(line.devices, [](const config::Device& device) {
      return std::ranges::any_of(device.points,
                                 [](const config::Point& point) { return point.writing.allowed; });
    });
  });
}

bool KeepsEvents(const config::Config& config) {
  if (config.events.given) return true;
  return std::ranges::any_of(config.lines, [](const config::Line& line) {
    return std::ranges::any_of(line.devices, [](const config::Device& device) {
      return device.events || device.point_events;
    });
  });
}

std::string WhatIsKept(const config::Config& config, const config::Catalog& catalog) {
  if (RoutesWrite(config)) {
    return "writes through routes, unless every listener has write: deny";
  }
  if (CanWrite(config)) return "writes";
  if (KeepsEvents(config)) return "events";
  if (config.history.on()) return "values";
  const bool remembered = std::ranges::any_of(config.lines, [&](const config::Line& line) {
    return std::ranges::any_of(line.devices, [&](const config::Device& device) {
      const auto remembers = catalog.FindProtocol(device.protocol)->remembers;
      return remembers != nullptr && remembers(device);
    });
  });
  return remembered ? "data learned from devices" : "";
}

StatePlaces StatePlaces::Here(const std::string& configured) {
  return {configured, Environment("STATE_DIRECTORY"), CanMakeSystemState(),
          Environment("XDG_STATE_HOME"), Environment("HOME")};
}

fs::path StateFolderOf(const StatePlaces& places, const std::string& gateway) {
  if (!places.configured.empty()) return fs::path(places.configured) / gateway;
  if (!places.state_directory.empty()) {
    return fs::path(places.state_directory.substr(0, places.state_directory.find(':'))) / gateway;
  }
  if (places.system) return fs::path(kSystemState) / gateway;
  if (!places.xdg_state_home.empty()) return fs::path(places.xdg_state_home) / "baudgate" / gateway;
  if (places.home.empty()) return {};
  return fs::path(places.home) / ".local/state/baudgate" / gateway;
}

namespace {

fs::path OwnFolderOf(const std::string& directory, const config::Config& config) {
  const fs::path folder = fs::path(directory) / config.name;
  const bool own =
      !directory.empty() && folder != StateFolderOf(StatePlaces::Here(config.state), config.name);
  return own ? folder : fs::path();
}

}  // namespace

fs::path EventsFolderOf(const config::Config& config) {
  return OwnFolderOf(config.events.directory, config);
}

fs::path HistoryFolderOf(const config::Config& config) {
  return OwnFolderOf(config.history.directory, config);
}

std::optional<StateFolder::Failure> StateFolder::Open() {
  const MutexLock guard(mutex_);
  if (lock_ >= 0 && IsFile(lock_, path_ / kLock)) return std::nullopt;
  if (lock_ >= 0) ::close(std::exchange(lock_, -1));
  std::error_code error;
  fs::create_directories(path_, error);
  if (std::string why = error ? std::string() : WhyNotTrusted(path_); !why.empty()) {
    return Failure{false, "the state folder is not used: " + why};
  }
  const fs::path file = path_ / kLock;
  const int lock =
      error ? -1 : ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NONBLOCK, kLockMode);
  if (lock < 0) {
    const int code = error ? error.value() : errno;
    if (!error && code == EISDIR) return Failure{false, file.string() + ": is a folder; remove it"};
    return Failure{false, fmt::format("{}: {}{}", path_.string(), SystemTrouble(code),
                                      HowToMake(path_, code))};
  }
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0) {
    ::close(lock);
    return Failure{true, "the state folder " + path_.string() +
                             " is in use: another baudgate with this gateway.name is running; stop "
                             "that baudgate, or set another gateway.name or gateway.state"};
  }
  if (std::string newer = NewerStateIn(path_); !newer.empty()) {
    ::close(lock);
    return Failure{true, std::move(newer)};
  }
  lock_ = lock;
  return std::nullopt;
}

std::optional<StateFolder::Failure> StateFolder::OpenWithin(
    const std::shared_ptr<StateFolder>& folder, Duration patience) {
  auto opening = std::make_shared<std::promise<std::optional<Failure>>>();
  auto opened = opening->get_future();
  const Status begun =
      StartDetached("state folder", [folder, opening] { opening->set_value(folder->Open()); });
  if (!begun) return folder->Open();
  if (opened.wait_for(patience) == std::future_status::ready) return opened.get();
  return Failure{false, folder->path().string() +
                            ": the disk of this folder does not answer; check the disk (dmesg)"};
}

StateFolder::~StateFolder() {
  const MutexLock guard(mutex_);
  if (lock_ >= 0) ::close(lock_);
}

}  // namespace baudgate::records
