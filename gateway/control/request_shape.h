// Which members each request of the control socket has, and of what type. What is misspelt or of
// another type is refused, and never taken for absent.
//
//   {"command":"reload","dry_run":"yes"}   'dry_run' of 'reload' is true or false, and not "yes"
//   {"command":"release","for":"10m"}      'for' is no member of 'release'; …
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "gateway/base/result.h"
#include "gateway/status/status_json.h"

namespace baudgate::control {

/// A request of a command that is not known has no shape: it is for others to refuse.
Status CheckShape(std::string_view command, const Json& request);

}  // namespace baudgate::control
