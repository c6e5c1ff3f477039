// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/ports/port_rights.h"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "gateway/base/user_name.h"
#include "transports/port_lock.h"

namespace baudgate {
namespace {

constexpr char kServiceUser[] = "baudgate";
constexpr mode_t kReadWrite = 06;
constexpr int kMostGroups = 256;

std::vector<gid_t> GroupsOf(const std::string& name, gid_t first) {
  std::vector<gid_t> groups(kMostGroups);
  int count = kMostGroups;
  if (::getgrouplist(name.c_str(), first, groups.data(), &count) < 0) count = kMostGroups;
  groups.resize(static_cast<std::size_t>(count));
  return groups;
}

/// The groups of this process. A user who has just joined another group has to log in again.
std::vector<gid_t> OwnGroups() {
  std::vector<gid_t> groups(kMostGroups);
  const int count = ::getgroups(kMostGroups, groups.data());
  groups.resize(static_cast<std::size_t>(std::max(count, 0)));
  groups.push_back(::getegid());
  return groups;
}

}  // namespace

std::optional<PortFile> ReadPortFile(const std::filesystem::path& root, const std::string& path) {
  struct stat info {};
  const std::string at = root / std::filesystem::path(path).relative_path();
  if (::stat(at.c_str(), &info) != 0) return std::nullopt;
  const struct ::group* entry = ::getgrgid(info.st_gid);
  return PortFile{path, info.st_uid, info.st_gid,
                  entry != nullptr ? entry->gr_name : std::to_string(info.st_gid), info.st_mode};
}

std::vector<Person> PeopleHere() {
  std::vector<Person> people;
  people.push_back({NameOfUser(::geteuid()), ::geteuid(), OwnGroups(), false});
  const struct ::passwd* service = ::getpwnam(kServiceUser);
  if (service == nullptr || service->pw_uid == ::geteuid()) return people;
  people.push_back({kServiceUser, service->pw_uid, GroupsOf(kServiceUser, service->pw_gid), true});
  return people;
}

/// As the kernel does: the first of owner, group and others that fits decides.
bool MayUse(const Person& person, const PortFile& file) {
  if (person.id == 0) return true;
  unsigned shift = 0;
  if (person.id == file.owner) {
    shift = 6;
  } else if (std::ranges::find(person.groups, file.group) != person.groups.end()) {
    shift = 3;
  }
  return ((file.mode >> shift) & kReadWrite) == kReadWrite;
}

std::string HowToMend(const Person& person, const PortFile& file) {
  const std::string who =
      person.is_service ? "the service (user baudgate)" : "you (" + person.name + ")";
  const std::string head = fmt::format("{} may not open {}: ", who, file.path);
  if (!IsGroupForPorts(file.group, file.mode)) return head + HowToGive(file.path);
  if (person.is_service) {
    return head + fmt::format(
                      "sudo systemctl edit baudgate, with [Service] and "
                      "SupplementaryGroups={}, then sudo systemctl restart baudgate",
                      file.group_name);
  }
  return head +
         fmt::format("sudo usermod -aG {} {}, then log in again", file.group_name, person.name);
}

}  // namespace baudgate
