// A fuzz target processes one input. Targets are registered by their source files and run by
// libfuzzer.cpp with new inputs (clang), or by replay_test.cpp with the corpora (ctest).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"

namespace baudgate::fuzz {

struct Target {
  std::string name;  ///< the name in targets.txt
  std::function<void(View input)> run;
};

/// Registers a target. Define a constant of this type, so that it is registered before main().
class Registered {
 public:
  Registered(std::string name, std::function<void(View input)> run);
};

const std::vector<Target>& Targets();

const Target* FindTarget(std::string_view name);

}  // namespace baudgate::fuzz
