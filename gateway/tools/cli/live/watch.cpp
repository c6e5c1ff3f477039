// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/live/watch.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "config/loader.h"
#include "gateway/base/exit_code.h"
#include "gateway/outputs/dds/link/child_process.h"

namespace baudgate {
namespace {

/// One profile a line.
std::string PointsOfProfiles(const config::Catalog& catalog) {
  std::string text;
  for (const config::ProfileFile& file : catalog.Profiles()) {
    const Protocol* protocol = catalog.FindProtocol(file.protocol);
    if (protocol == nullptr) continue;
    const auto loaded = config::LoadProfile(file.path.string(), *protocol, catalog);
    for (const config::Point& point : loaded.profile.points) {
      text += (point.access == config::Access::write ? "-" : "") + point.name + " ";
    }
    text += "\n";
  }
  return text;
}

/// A file in memory that the program gets, too; empty: it cannot be had, and names are the order.
std::string FileOf(const std::string& text) {
  const int file = ::memfd_create("point-order", 0);
  if (file < 0 || ::write(file, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    return {};
  }
  return "/proc/self/fd/" + std::to_string(file);
}

}  // namespace

int RunWatch(const std::vector<std::string>& words, const config::Catalog& catalog,
             std::ostream& err) {
  const auto program = dds::FindProgram("baudgate-dds");
  if (!program) {
    err << "watch: " << program.error() << "; install it\n";
    return kExitCanNot;
  }
  std::vector<std::string> all{"baudgate", "watch"};  // by this name it speaks of itself
  all.insert(all.end(), words.begin(), words.end());
  if (const std::string order = FileOf(PointsOfProfiles(catalog)); !order.empty()) {
    all.insert(all.end(), {"--point-order", order});
  }
  std::vector<char*> pointers;
  for (std::string& word : all) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(program->c_str(), pointers.data());
  err << "watch: " << *program << ": " << std::strerror(errno) << "\n";
  return kExitCanNot;
}

}  // namespace baudgate
