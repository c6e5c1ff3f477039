// Reads test cases from a file: input and expected results. Paths are relative to the root of the
// source tree.
//
//   # a comment
//   @ HEAD            begins a section, up to the next one
//   |                 more lines of the section
//   - GIVEN           begins a case
//   |                 more lines of the case
//   = RESULT          a sign and a text, whose meaning the test defines
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace baudgate {

struct FileCase {
  std::string place;
  std::string head{};
  std::vector<std::string> form{};
  std::vector<std::string> given{};
  std::vector<std::pair<char, std::string>> results{};
};

inline std::vector<FileCase> ReadFileCases(const std::string& path) {
  std::ifstream file(path);
  std::vector<FileCase> cases;
  FileCase section;
  bool in_section = false;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    const std::string rest = line.size() > 2 ? line.substr(2) : "";
    if (line[0] == '@') {
      section = {.place = {}, .head = rest};
      in_section = true;
    } else if (line[0] == '-') {
      cases.push_back(section);
      cases.back().place = path + ":" + std::to_string(number);
      cases.back().given = {rest};
      in_section = false;
    } else if (line[0] != '|') {
      cases.back().results.emplace_back(line[0], rest);
    } else {
      (in_section ? section.form : cases.back().given).push_back(rest);
    }
  }
  return cases;
}

}  // namespace baudgate
