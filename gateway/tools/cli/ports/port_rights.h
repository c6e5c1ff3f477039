// Who may open a serial port, and the command that lets somebody who may not.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace baudgate {

/// The file of a port: /dev/ttyUSB0 root:dialout 0660.
struct PortFile {
  std::string path;
  uid_t owner = 0;
  gid_t group = 0;
  std::string group_name;
  mode_t mode = 0;
};

struct Person {
  std::string name;
  uid_t id = 0;
  std::vector<gid_t> groups;
  bool is_service = false;  ///< the user of baudgate.service
};

/// Empty: there is no such file.
std::optional<PortFile> ReadPortFile(const std::filesystem::path& root, const std::string& path);

/// Ourselves and, if this machine has it, the service's user.
std::vector<Person> PeopleHere();

bool MayUse(const Person& person, const PortFile& file);
/// "you may not open /dev/ttyUSB0: sudo usermod -aG dialout anna, then log in again".
std::string HowToMend(const Person& person, const PortFile& file);

}  // namespace baudgate
