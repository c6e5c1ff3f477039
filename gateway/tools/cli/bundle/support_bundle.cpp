// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/bundle/support_bundle.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "config/copies.h"
#include "config/yaml/yaml_source.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/version.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/status_view.h"
#include "gateway/tools/terminal/words.h"

namespace baudgate::tools {
namespace {

constexpr const char* kFolder = "baudgate-support";

struct Ran {
  std::string output;
  bool well = false;
};
Ran Run(const std::string& command) {
  FILE* const pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return {};
  std::string text;
  std::array<char, 65536> chunk{};
  while (const std::size_t count = std::fread(chunk.data(), 1, chunk.size(), pipe)) {
    text.append(chunk.data(), count);
  }
  return {std::move(text), ::pclose(pipe) == 0};
}

/// The files of a bundle, in a folder that only this user can read, until tar(1) packs them.
class Archive {
 public:
  /// `at` becomes the modification time of every file.
  explicit Archive(WallTime at) : at_(at) {
    std::error_code gone;
    std::string path = (std::filesystem::temp_directory_path(gone) / "baudgate-XXXXXX").string();
    if (!gone && ::mkdtemp(path.data()) != nullptr) folder_ = path;
  }
  ~Archive() {
    std::error_code gone;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, gone);
  }
  Archive(const Archive&) = delete;
  Archive& operator=(const Archive&) = delete;

  /// Adds a file. In `name`, '_' replaces all characters other than letters, digits, '.', '-', '_'
  /// and '/', and each '.' before another '.'.
  void Add(std::string name, const std::string& content) {
    if (folder_.empty()) return;
    for (char& c : name) {
      const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
                         (c >= 'A' && c <= 'Z') ||
                         std::string_view(".-_/").find(c) != std::string_view::npos;
      if (!plain) c = '_';
    }
    for (auto at = name.find(".."); at != std::string::npos; at = name.find("..")) name[at] = '_';
    const std::filesystem::path file = folder_ / kFolder / name;
    std::error_code failed;
    std::filesystem::create_directories(file.parent_path(), failed);
    whole_ = (std::ofstream(file) << content).flush().good() && whole_;
  }
  Result<std::string> Packed() const {
    const bool quotable = folder_.string().find('\'') == std::string::npos;
    if (folder_.empty() || !whole_ || !quotable)
      return Error{
          "the bundle cannot be written to the temporary folder; set TMPDIR to another folder"};
    Ran packed = Run(fmt::format(
        "tar --create --gzip --sort=name --owner=root:0 --group=root:0 --mode=u=rwX,go= "
        "--mtime=@{} --directory='{}' {}",
        at_.time_since_epoch() / 1s, folder_.string(), kFolder));
    if (!packed.well)
      return Error{"tar cannot pack the bundle; check that tar and gzip are installed"};
    return std::move(packed.output);
  }

 private:
  const WallTime at_;
  std::filesystem::path folder_;
  bool whole_ = true;
};

}  // namespace

Result<std::string> SystemLog() {
  constexpr const char* kCommand =
      "journalctl --quiet --no-pager --utc --output=short-iso-precise --lines=5000 "
      "--unit=baudgate --unit=baudgate-dds 2>/dev/null";
  std::string text = Run(kCommand).output;
  if (!text.empty()) return text;
  return Error{
      "journalctl shows no line of the service baudgate. Check that systemd runs the gateway, and "
      "that you may read the journal (group adm or systemd-journal, or sudo)"};
}

namespace {

using Json = ControlClient::Json;

std::string Dump(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string SystemText() {
  std::string text;
  utsname name{};
  if (::uname(&name) == 0) {
    text = std::string("kernel: ") + name.sysname + " " + name.release + " " + name.machine + "\n";
  }
  std::ifstream release("/etc/os-release");
  for (std::string line; std::getline(release, line);) {
    if (line.starts_with("PRETTY_NAME=")) text += "system: " + line.substr(12) + "\n";
  }
  return text;
}

/// Collects the content of the bundle, and a list of what is missing with the reasons.
class Bundle {
 public:
  Bundle(const BundleOptions& options, const config::Catalog& catalog, WallTime now)
      : options_(options), catalog_(catalog), now_(now), archive_(now) {}

  void Fill() {
    AddGateway();
    AddConfiguration();
    AddLog();
    std::string versions = std::string("this program: baudgate ") + kVersion + "\n";
    if (!gateway_version_.empty()) versions += "the gateway: baudgate " + gateway_version_ + "\n";
    Add("versions.txt", versions + SystemText());
    std::string contents = "baudgate support bundle, " + FormatWallTime(now_) + "\n";
    for (const std::string& name : names_) contents += "has: " + name + "\n";
    for (const std::string& what : missing_) contents += "missing: " + what + "\n";
    archive_.Add("contents.txt", contents);
  }

  const std::vector<std::string>& missing() const { return missing_; }
  Result<std::string> Packed() const { return archive_.Packed(); }

 private:
  void Add(const std::string& name, const std::string& content) {
    archive_.Add(name, content);
    names_.push_back(name);
  }
  void Miss(const std::string& what, std::string why) {
    while (!why.empty() && why.back() == '\n') why.pop_back();
    if (why.starts_with("baudgate: ")) why.erase(0, 10);
    missing_.push_back(what + ": " + why);
  }

  void AddGateway() {
    Json status;
    std::ostringstream told;
    if (Ask(options_.socket, {{"command", "status"}}, status, told) != 0) {
      return Miss("status and traces", told.str());
    }
    answers_ = true;
    Add("status.json", Dump(status));
    try {
      Add("status.txt", RenderStatus(status, {}, {}));
      gateway_version_ = status.value("version", "");
      const Json& configuration = status.at("configuration");
      if (configuration.is_object()) file_ = configuration.value("file", "");
      for (const Json& line : status.at("lines")) AddTrace(line.at("name").get<std::string>());
    } catch (const Json::exception&) {
      Miss("the status as text, traces",
           "the gateway has another version than this program; restart or update the gateway");
    }
  }

  void AddTrace(const std::string& line) {
    Json answer;
    std::ostringstream told;
    const Json request = {{"command", "recorded"}, {"target", line}};
    if (Ask(options_.socket, request, answer, told) != 0) {
      return Miss("trace of " + line, told.str());
    }
    std::string text;
    for (const char* part : {"head", "records"}) {
      for (const Json& one : answer.value(part, Json::array())) {
        if (one.is_string()) text += one.get<std::string>() + "\n";
      }
    }
    Add("trace/" + line + ".trace", text);
  }

  void AddConfiguration() {
    std::string file = options_.config.empty() ? file_ : options_.config;
    if (file.empty() && answers_) {
      return Miss("configuration",
                  "the running gateway was not started with a file; name the file with -c");
    }
    if (file.empty()) file = kInstalledConfig;
    std::error_code gone;
    const auto kind = std::filesystem::status(file, gone).type();
    if (!gone && kind != std::filesystem::file_type::regular) {
      return Miss("configuration", file + ": is not a regular file");  // opening a pipe would block
    }
    const auto text = config::ReadWholeFile(file);
    if (!text) return Miss("configuration", file + ": " + text.error());
    const auto masked = config::MaskedConfig(*text, config::SecretKeys(catalog_));
    if (!masked) return Miss("configuration", file + ": " + masked.error());
    Add("configuration.yaml", "# " + file + ", without comments and secrets\n" + *masked);
  }

  void AddLog() {
    const auto log = options_.log();
    if (!log) return Miss("log", log.error());
    Add("log.txt", *log);
  }

  const BundleOptions& options_;
  const config::Catalog& catalog_;
  const WallTime now_;
  Archive archive_;
  bool answers_ = false;
  std::string gateway_version_;
  std::string file_;  // the configuration file of the running gateway
  std::vector<std::string> names_;
  std::vector<std::string> missing_;
};

/// Writes a new file that only its owner can read, because the bundle shows much of a plant.
Status WriteNew(const std::string& file, const std::string& content) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0) return Error{file + ": " + std::strerror(errno)};
  std::size_t written = 0;
  while (written < content.size()) {
    const auto count = ::write(descriptor, content.data() + written, content.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const Error error{file + ": " + std::strerror(errno)};
      ::close(descriptor);
      ::unlink(file.c_str());
      return error;
    }
    written += static_cast<std::size_t>(count);
  }
  if (::close(descriptor) == 0) return {};
  return Error{file + ": " + std::strerror(errno)};
}

}  // namespace

int RunSupportBundle(const BundleOptions& options, const config::Catalog& catalog, WallTime now,
                     std::ostream& out, std::ostream& err) {
  Bundle bundle(options, catalog, now);
  bundle.Fill();
  const auto packed = bundle.Packed();
  const Status written = packed ? WriteNew(options.file, *packed) : Status(Error{packed.error()});
  if (!written) {
    err << "baudgate: " << written.error() << '\n';
    return kExitCanNot;
  }
  for (const std::string& what : bundle.missing()) err << "baudgate: missing: " << what << '\n';
  out << options.file << ": " << packed->size()
      << " bytes; check the contents before you send the file\n";
  return kExitDone;
}

}  // namespace baudgate::tools
