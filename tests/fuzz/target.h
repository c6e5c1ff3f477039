// Runs a fuzz target on one input. Each source file registers its target. tests/fuzz/libfuzzer.cpp
// runs the target with new inputs (clang), tests/fuzz/replay_test.cpp with the corpora (ctest).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"

namespace baudgate::fuzz {

struct Target {
  std::string name;
  std::function<void(View input)> run;
};

class Registered {
 public:
  Registered(std::string name, std::function<void(View input)> run);
};

const std::vector<Target>& Targets();

const Target* FindTarget(std::string_view name);

}  // namespace baudgate::fuzz
