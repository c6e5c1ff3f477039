// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/socket_path.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace baudgate::control {
namespace {

constexpr const char* kServiceDirectory = "/run/baudgate";

}  // namespace

std::vector<std::string> SocketDirectories() {
  std::vector<std::string> directories = {kServiceDirectory};
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && *runtime == '/') {
    directories.push_back(std::string(runtime) + "/baudgate");
  }
  directories.push_back("/tmp/baudgate-" + std::to_string(::getuid()));
  return directories;
}

std::vector<std::string> SocketPaths(const std::string& gateway) {
  std::vector<std::string> paths;
  for (const std::string& directory : SocketDirectories()) {
    paths.push_back(directory + "/" + gateway + ".sock");
  }
  return paths;
}

Status PrepareDirectory(const std::string& directory) {
  const bool of_service = directory == kServiceDirectory;
  if (!of_service && ::mkdir(directory.c_str(), 0700) != 0 && errno != EEXIST) {
    return Error{directory + ": " + std::strerror(errno)};
  }
  struct stat found {};
  if (::lstat(directory.c_str(), &found) != 0)
    return Error{directory + ": " + std::strerror(errno)};
  if (!S_ISDIR(found.st_mode)) return Error{directory + ": not a directory"};
  if (of_service) return {};
  if (found.st_uid != ::getuid() || (found.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    return Error{directory + ": another user owns it or may write to it"};
  }
  return {};
}

std::vector<std::string> ListSockets(const std::vector<std::string>& directories) {
  std::vector<std::string> sockets;
  for (const std::string& directory : directories) {
    std::vector<std::string> here;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(directory, error)) {
      std::error_code ignored;
      if (entry.path().extension() == ".sock" && entry.is_socket(ignored)) {
        here.push_back(entry.path().string());
      }
    }
    std::sort(here.begin(), here.end());
    sockets.insert(sockets.end(), here.begin(), here.end());
  }
  return sockets;
}

}  // namespace baudgate::control
