// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/target.h"

#include <algorithm>
#include <utility>

namespace baudgate::fuzz {
namespace {

std::vector<Target>& AllTargets() {
  static std::vector<Target> all;
  return all;
}

}  // namespace

Registered::Registered(std::string name, std::function<void(View input)> run) {
  AllTargets().push_back({std::move(name), std::move(run)});
}

const std::vector<Target>& Targets() { return AllTargets(); }

const Target* FindTarget(std::string_view name) {
  const auto found = std::ranges::find(AllTargets(), name, &Target::name);
  return found == AllTargets().end() ? nullptr : &*found;
}

}  // namespace baudgate::fuzz
