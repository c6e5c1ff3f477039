// What devices and protocols say of a failure, cut to what a first sentence has room for. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/finding.h"

namespace baudgate::control {

/// Up to its first semicolon; of a long one the first part, and of a long quotation the beginning.
std::string Shortened(const std::string& reason);
/// What a device has said in place of values, without its own advice.
std::string Brief(const Finding& finding);
/// What to do about it.
std::string RemedyOf(const Finding& finding);
/// "slave 7 answers …: check the address …".
std::string WithRemedy(const Finding& finding);

}  // namespace baudgate::control
