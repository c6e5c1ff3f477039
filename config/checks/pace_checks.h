// Times, periods and retries that somebody wrote and that do not count, because something else
// overrules them. Paces come from config/devices; warnings go to Problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/mark.h"
#include "config/model/problem.h"
#include "config/model/timing.h"

namespace baudgate::config {

/// The paces of one device: its own, its profile's and its line's (before the gateway). `mark`: of
/// the device.
struct Paces {
  const Pace& device;
  const Pace& profile;
  const Pace& line;
};
void CheckPaces(const Paces& paces, const std::string& device, const Mark& mark,
                Problems& problems);

}  // namespace baudgate::config
