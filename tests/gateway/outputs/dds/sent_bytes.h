// Everything that this process hands to the network, whichever library does it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace baudgate::dds::testing {

/// Records while it lives; one at a time.
class SentBytes {
 public:
  SentBytes();
  ~SentBytes();
  SentBytes(const SentBytes&) = delete;
  SentBytes& operator=(const SentBytes&) = delete;

  std::string All() const;
};

}  // namespace baudgate::dds::testing
