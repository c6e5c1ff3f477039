// A fuzz target: what is done with one input. A source registers those that it has, and one of two
// programs runs them: libfuzzer.cpp with new inputs (clang), replay_test.cpp with all inputs of the
// corpora (ctest).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"

namespace baudgate::fuzz {

struct Target {
  std::string name;  ///< as in targets.txt
  std::function<void(View input)> run;
};

/// A constant of this type makes a target known before main() begins.
class Registered {
 public:
  Registered(std::string name, std::function<void(View input)> run);
};

/// All that are known.
const std::vector<Target>& Targets();

/// Null: there is none of that name.
const Target* FindTarget(std::string_view name);

}  // namespace baudgate::fuzz
