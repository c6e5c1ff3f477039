// The shipped protocols with their profiles, for tests of whole configurations.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/loader.h"

namespace baudgate::testing {

const config::Catalog& Shipped();

}  // namespace baudgate::testing
