// `baudgate protocols [NAME]`: what is installed, and the options and decoders of one protocol.
// Descriptors come from the catalog; text or JSON goes to the streams of the caller.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>

#include "config/catalog/catalog.h"

namespace baudgate {

/// An empty name lists all. Exit codes: 0 done, 2 no such protocol.
int RunProtocols(const std::string& name, bool json, const config::Catalog& catalog,
                 std::ostream& out, std::ostream& err);

}  // namespace baudgate
