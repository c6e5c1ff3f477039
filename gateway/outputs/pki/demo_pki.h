// A folder of everything that DDS Security needs to be tried, or to run a small plant:
//
//   DIR/ca/ca.pem key.pem                       the authority; its key belongs nowhere else
//   DIR/NAME/ca.pem identity.pem key.pem governance.p7s permissions.p7s       of a gateway
//   DIR/subscriber-1/…                          the same five of a subscriber
//   DIR/writer-1/…                              of a subscriber who may write
//
// Written by `baudgate certs dds`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::pki {

inline constexpr Duration kDemoValidity = 5 * 365 * 24h;

struct DemoPkiOptions {
  std::string directory;
  std::vector<std::string> gateways;  ///< names
  int subscribers = 0;                ///< numbered on from those that are there; may subscribe only
  int writers = 0;                    ///< the same; may publish baudgate/write as well
  Duration validity = kDemoValidity;  ///< of identities and permissions; the authority's at least
};

/// The folders that were made, in order. An authority that is there already is used; nothing is
/// ever written over. Keys can be read by their owner alone.
Result<std::vector<std::string>> WriteDemoPki(const DemoPkiOptions& options, WallTime now);

}  // namespace baudgate::pki
