// Whether a request has the members of its command (gateway/outputs/control/commands.h), with their
// types. A member that is misspelt or has another type is refused. It is never ignored.
//
//   {"command":"reload","dry_run":"yes"}   'dry_run' of 'reload' is true or false, and not "yes"
//   {"command":"release","for":"10m"}      'for' is no member of 'release'; …
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/outputs/control/commands.h"

namespace baudgate::control {

Status CheckShape(const Command& command, const Json& request);

}  // namespace baudgate::control
