// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/bundle/support_bundle.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>
#include <vector>

#include "config/copies.h"
#include "config/yaml/yaml_source.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/version.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/status_view.h"
#include "gateway/tools/terminal/words.h"

namespace baudgate {

namespace {

constexpr std::size_t kBlock = 512;
constexpr std::size_t kLongestName = 90;  // of 100 in a header

std::string SafeName(std::string_view name) {
  std::string safe(name.substr(0, kLongestName));
  for (char& c : safe) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                       std::string_view(".-_/").find(c) != std::string_view::npos;
    if (!plain) c = '_';
  }
  return safe;
}

/// A header of ustar: fields at fixed places, numbers in octal.
std::string HeaderOf(const std::string& name, std::size_t size, WallTime at) {
  std::string header(kBlock, '\0');
  const auto put = [&header](std::size_t place, const std::string& text) {
    header.replace(place, text.size(), text);
  };
  put(0, name.substr(0, kLongestName));
  put(100, "0000600");  // mode
  put(108, "0000000");  // owner
  put(116, "0000000");  // group
  put(124, fmt::format("{:011o}", size));
  put(136, fmt::format("{:011o}", std::max<std::int64_t>(0, at.time_since_epoch() / 1s)));
  put(148, "        ");  // in place of the checksum
  put(156, "0");         // a file
  put(257, "ustar");
  put(263, "00");
  unsigned sum = 0;
  for (const char c : header) sum += static_cast<unsigned char>(c);
  put(148, fmt::format("{:06o}", sum) + std::string(1, '\0') + " ");
  return header;
}

}  // namespace

Archive::Archive(std::string folder, WallTime at) : folder_(std::move(folder)), at_(at) {}

void Archive::Add(std::string_view name, std::string_view content) {
  tar_ += HeaderOf(SafeName(folder_ + "/" + std::string(name)), content.size(), at_);
  tar_ += content;
  tar_.append((kBlock - content.size() % kBlock) % kBlock, '\0');
}

Result<std::string> Archive::Packed() const {
  constexpr int kWithGzipHeader = 15 + 16;
  constexpr int kMemory = 8;
  std::string plain = tar_ + std::string(2 * kBlock, '\0');  // the end of a tar
  z_stream stream{};
  if (::deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kWithGzipHeader, kMemory,
                     Z_DEFAULT_STRATEGY) != Z_OK) {
    return Error{"there is no memory to pack it"};
  }
  std::string packed(::deflateBound(&stream, static_cast<uLong>(plain.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(plain.data());
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int code = ::deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  ::deflateEnd(&stream);
  if (code != Z_STREAM_END) return Error{"it cannot be packed"};
  return packed;
}

Result<std::string> SystemLog() {
  constexpr const char* kCommand =
      "journalctl --quiet --no-pager --utc --output=short-iso-precise --lines=5000 "
      "--unit=baudgate --unit=baudgate-dds 2>/dev/null";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(kCommand, "r"), ::pclose);
  if (!pipe) return Error{"journalctl cannot be started"};
  std::string text;
  std::array<char, 65536> chunk{};
  while (const std::size_t count = std::fread(chunk.data(), 1, chunk.size(), pipe.get())) {
    text.append(chunk.data(), count);
  }
  if (!text.empty()) return text;
  return Error{
      "journalctl has no line of the service: it is not installed, the gateway is not run by "
      "systemd, or you may not read its journal (group adm or systemd-journal, or sudo)"};
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

/// What goes in, and what is missing and why.
class Bundle {
 public:
  Bundle(const BundleOptions& options, const config::Catalog& catalog, WallTime now)
      : options_(options), catalog_(catalog), now_(now), archive_("baudgate-support", now) {}

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
      Miss("the status as text, traces", "the gateway is of another version");
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
      return Miss("configuration", "the running gateway was not started with a file");
    }
    if (file.empty()) file = kInstalledConfig;
    std::error_code gone;
    const auto kind = std::filesystem::status(file, gone).type();
    if (!gone && kind != std::filesystem::file_type::regular) {
      return Miss("configuration", file + ": is no regular file");  // a pipe would wait
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
  std::string file_;  // of the running gateway
  std::vector<std::string> names_;
  std::vector<std::string> missing_;
};

/// For its owner only: it shows much of a plant.
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
  out << options.file << ": " << packed->size() << " bytes; look into it before you send it\n";
  return kExitDone;
}

}  // namespace baudgate
