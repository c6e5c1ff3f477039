// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/settings/comparison.h"

#include <algorithm>
#include <cmath>

#include "config/model/device.h"
#include "config/model/problem.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::settings {
namespace {

/// Relative: what a float32 holds of a number.
constexpr double kSame = 1e-6;

Error Wrong(const config::Mark& mark, const std::string& message) {
  return Error{config::ToString({mark, message})};
}

bool IsNear(double a, double b) {
  return std::abs(a - b) <= kSame * std::max(std::abs(a), std::abs(b));
}

/// "A", "A (400 times what the device says)".
std::string UnitOf(const Setting& setting) {
  const std::string unit = setting.unit.empty() ? "no unit" : setting.unit;
  if (setting.scale == 1) return unit;
  return unit + " (" + FormatNumber(setting.scale) + " times what the device says)";
}

}  // namespace

bool IsSameValue(const std::string& a, const std::string& b, std::optional<double> resolution) {
  const auto one = ParseDecimal(a);
  const auto other = ParseDecimal(b);
  if (!one || !other) return a == b;
  if (resolution && std::abs(*one - *other) >= *resolution / 2) return false;
  return IsNear(*one, *other);
}

Status CheckFit(const Sheet& file, const Sheet& now) {
  const auto quoted = [](const std::string& text) { return config::Quoted(text); };
  if (file.protocol != now.protocol || file.profile != now.profile) {
    return Wrong(file.mark, "these are settings of a " + file.protocol + " device of profile " +
                                quoted(file.profile) + ", and " + now.target() + " is one of " +
                                now.protocol + ", profile " + quoted(now.profile));
  }
  if (file.designation.empty()) {
    return Wrong(file.mark, "designation: it does not say which device it was read from");
  }
  if (now.designation.empty()) {
    return Wrong(file.mark, now.target() +
                                " has not said yet what it is, or does not answer; see "
                                "'baudgate status " +
                                now.target() + "'");
  }
  if (config::SpokenName(file.designation) != config::SpokenName(now.designation)) {
    return Wrong(file.mark, "these are settings of a " + quoted(file.designation) + ", and " +
                                now.target() + " calls itself " + quoted(now.designation));
  }
  for (const Setting& filed : file.settings) {
    const Setting* const here = now.Find(filed.point);
    if (here == nullptr) {
      return Wrong(filed.mark, now.target() + " has no setting " + quoted(filed.point));
    }
    if (here->item != filed.item) {
      return Wrong(filed.mark, quoted(filed.point) + " is " + filed.item + " here, and " +
                                   here->item + " of " + now.target());
    }
    if (here->unit != filed.unit || !IsNear(here->scale, filed.scale)) {
      return Wrong(filed.mark, quoted(filed.point) + " is in " + UnitOf(filed) + " here, and in " +
                                   UnitOf(*here) + " of " + now.target() +
                                   ": its `ratios` or `scale` have changed");
    }
  }
  return {};
}

Comparison Compare(const Sheet& file, const Sheet& now) {
  Comparison comparison;
  for (const Setting& filed : file.settings) {
    const Setting* const here = now.Find(filed.point);
    if (here == nullptr) continue;  // CheckFit has said so
    if (!filed.known) {
      comparison.open.push_back(filed.point + " (" + filed.item +
                                ") was not known when the file was written");
    } else if (!here->known) {
      ++comparison.unread;
      comparison.open.push_back(filed.point + " (" + filed.item +
                                ") is not known now: " + here->quality);
    } else if (!IsSameValue(*filed.value, *here->value, here->resolution)) {
      comparison.different.push_back({&filed, here});
    }
  }
  for (const Setting& here : now.settings) {
    if (file.Find(here.point) == nullptr) {
      comparison.open.push_back(here.point + " (" + here.item + ") is not in the file");
    }
  }
  return comparison;
}

}  // namespace baudgate::settings
