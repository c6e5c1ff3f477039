// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/live/watch.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "gateway/base/exit_code.h"
#include "gateway/dds/link/child_process.h"

namespace baudgate {
namespace {}  // namespace

int RunWatch(const std::vector<std::string>& words, std::ostream& err) {
  const auto program = dds::FindProgram("baudgate-dds");
  if (!program) {
    err << "watch: " << program.error() << "; install it\n";
    return kExitCanNot;
  }
  std::vector<std::string> all{"baudgate", "watch"};  // by this name it speaks of itself
  all.insert(all.end(), words.begin(), words.end());
  std::vector<char*> pointers;
  for (std::string& word : all) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(program->c_str(), pointers.data());
  err << "watch: " << *program << ": " << std::strerror(errno) << "\n";
  return kExitCanNot;
}

}  // namespace baudgate
