// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/socket_path.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "gateway/base/system_trouble.h"
#include "gateway/base/trusted_file.h"

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
    return Error{directory +
                 ": another user owns this folder or may write to it; make a folder that belongs "
                 "to you alone (chmod 700)"};
  }
  return {};
}

std::string WhyNotBelieved(const std::string& path, uid_t listener, bool is_given) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const bool of_service = folder == kServiceDirectory;
  if (!of_service && !is_given) {
    if (std::string why = WhyNotTrusted(folder); !why.empty()) return why;
  }
  if (listener == 0 || (!of_service && listener == ::getuid())) return {};
  struct stat its {};
  const bool is_owner =
      ::stat(folder.c_str(), &its) == 0 && its.st_uid == listener && (its.st_mode & S_IWOTH) == 0;
  if (is_owner && (of_service || is_given)) return {};
  return path + " is not used: a program of user '" + NameOfUser(listener) +
         "' listens there, and the folder belongs to another user";
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
