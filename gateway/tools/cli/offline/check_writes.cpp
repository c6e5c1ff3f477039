// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/check_writes.h"

#include <string>
#include <vector>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr std::size_t kMostNamed = 8;

/// "a, b, c and 4 more".
std::string Listed(const std::vector<std::string>& all) {
  std::string text;
  for (std::size_t i = 0; i < all.size() && i < kMostNamed; ++i) {
    text += (i == 0 ? "" : ", ") + all[i];
  }
  if (all.size() > kMostNamed) text += " and " + std::to_string(all.size() - kMostNamed) + " more";
  return text;
}

/// Those with rules, which are to be seen, and then the others.
std::string ListedWithRules(const std::vector<std::string>& ruled,
                            const std::vector<std::string>& plain) {
  std::string text;
  for (const std::string& one : ruled) text += (text.empty() ? "" : ", ") + one;
  if (plain.empty()) return text;
  return text + (text.empty() ? "" : ", ") + Listed(plain);
}

/// " (0.5 to 40 xIn, selected first)", or nothing.
std::string Rules(const config::Point& point) {
  const config::Writing& writing = point.writing;
  std::vector<std::string> rules;
  const std::string unit = point.unit.empty() ? "" : " " + point.unit;
  const std::string min = writing.min ? writing.min->ToText() + unit : *writing.min_point;
  const std::string max = writing.max ? writing.max->ToText() + unit : *writing.max_point;
  if (writing.min && writing.max) {
    rules.push_back(writing.min->ToText() + " to " + max);
  } else if (!min.empty() && !max.empty()) {
    rules.push_back(min + " to " + max);
  } else if (!min.empty()) {
    rules.push_back("from " + min);
  } else if (!max.empty()) {
    rules.push_back("to " + max);
  }
  if (writing.step) rules.push_back("steps of " + writing.step->ToText());
  if (writing.select) rules.emplace_back("selected first");
  for (const config::AllowWhen& interlock : writing.allow_when) {
    rules.push_back("when " + interlock.point + " is " + ToText(interlock.is));
  }
  return rules.empty() ? "" : " (" + Listed(rules) + ")";
}

struct Writes {
  std::vector<std::string> allowed;
  std::vector<std::string> ruled;  ///< of those, what has rules, and these
  std::vector<std::string> plain;  ///< of those, all others
  std::vector<std::string> off;
};

Writes WritesOf(const config::Device& device) {
  Writes writes;
  for (const config::Point& point : device.points) {
    if (point.writing.allowed) {
      const std::string rules = Rules(point);
      writes.allowed.push_back(point.name);
      (rules.empty() ? writes.plain : writes.ruled).push_back(point.name + rules);
    } else if (point.access != config::Access::read) {
      writes.off.push_back(point.name);
    }
  }
  return writes;
}

}  // namespace

void PrintWrites(const config::Line& line, std::ostream& out) {
  for (const config::Device& device : line.devices) {
    const Writes writes = WritesOf(device);
    if (writes.allowed.empty() && writes.off.empty()) continue;
    out << "  writes to " << device.name << ": "
        << (writes.allowed.empty() ? "none" : ListedWithRules(writes.ruled, writes.plain));
    if (!writes.off.empty()) {
      out << "; " << Listed(writes.off) << " could be written: add 'write: allow', or a list of "
          << "points, to the device";
    }
    out << '\n';
  }
}

nlohmann::ordered_json WritesJson(const config::Device& device) {
  const Writes writes = WritesOf(device);
  return {{"allowed", writes.allowed}, {"off", writes.off}};
}

}  // namespace baudgate
