// SPDX-License-Identifier: Apache-2.0
#include "tests/config/shipped.h"

#include "protocols/all_protocols.h"

namespace baudgate::testing {

const config::Catalog& Shipped() {
  static const config::Catalog kCatalog = [] {
    config::Catalog catalog;
    for (const protocols::Protocol* protocol : protocols::AllProtocols()) {
      catalog.protocols.emplace(protocol->name, protocol);
    }
    catalog.profile_dirs = {"config/profiles"};
    return catalog;
  }();
  return kCatalog;
}

}  // namespace baudgate::testing
