// Runs the fuzz target that the file name of the program names, with libFuzzer.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "tests/fuzz/target.h"

namespace {

const baudgate::fuzz::Target* chosen = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char*** argv) {
  const std::string name = std::filesystem::path((*argv)[0]).filename();
  chosen = baudgate::fuzz::FindTarget(name);
  if (chosen != nullptr) return 0;
  std::fprintf(stderr, "%s is no fuzz target of this program. Its targets:\n", name.c_str());
  for (const auto& target : baudgate::fuzz::Targets()) {
    std::fprintf(stderr, "  %s\n", target.name.c_str());
  }
  std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->run(baudgate::View(data, size));
  return 0;
}
