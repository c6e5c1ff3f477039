// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/versions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include "gateway/base/whole_file.h"
#include "gateway/records/disk/events_file.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;

struct Known {
  std::int64_t application;
  std::int64_t version;
};
/// events.db, and of gateway/records/history values-YYYYMMDD.db and trends.db.
constexpr std::array<Known, 3> kKnown = {
    {{kEventsApplication, kEventsVersion}, {0x42477661, 1}, {0x42477472, 1}}};

/// How an SQLite file begins: https://www.sqlite.org/fileformat.html, 1.3.
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

/// Empty: it is no database. Years of history are a thousand files: SQLite reads only those that
/// have a log, which a gateway that was killed leaves.
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
      "{} was written by a newer baudgate (version {} of the file, this one knows {}); nothing was "
      "changed. Start the newer one, or give this one another gateway.state",
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

}  // namespace baudgate
