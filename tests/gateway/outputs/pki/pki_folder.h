// `PkiFolder`: a folder with certificates, which is removed after the test.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "config/model/outputs.h"
#include "gateway/outputs/pki/demo_pki.h"

namespace baudgate::pki::testing {

inline constexpr WallTime kNow{std::chrono::sys_days{std::chrono::year{2026} / 11 / 22}};

class PkiFolder {
 public:
  explicit PkiFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() /
              ("baudgate-pki-" + std::to_string(::getpid()) + "-" + name)) {
    std::filesystem::remove_all(path_);
  }
  ~PkiFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  PkiFolder(const PkiFolder&) = delete;
  PkiFolder& operator=(const PkiFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string In(const std::string& file) const { return (path_ / file).string(); }
  config::DdsSecurity Of(const std::string& name) const { return config::SecurityIn(In(name)); }

  Result<std::vector<std::string>> Make(std::vector<std::string> gateways, int subscribers,
                                        WallTime now, Duration validity = kDemoValidity,
                                        int writers = 0) const {
    return WriteDemoPki({path_.string(), std::move(gateways), subscribers, writers, validity}, now);
  }

 private:
  std::filesystem::path path_;
};

inline std::string ReadText(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::trunc) << text;
}

}  // namespace baudgate::pki::testing
