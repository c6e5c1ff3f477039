// `SentBytes` records all bytes that any library of this process sends to the network.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace baudgate::dds::testing {

/// Records until it is destroyed. Only one object can exist at a time.
class SentBytes {
 public:
  SentBytes();
  ~SentBytes();
  SentBytes(const SentBytes&) = delete;
  SentBytes& operator=(const SentBytes&) = delete;

  std::string All() const;
};

}  // namespace baudgate::dds::testing
