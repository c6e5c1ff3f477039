// The discovery server's socket: datagrams go to
// gateway/outputs/dds/discovery/announcement_relay.h, and what it answers goes out.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/network.h"
#include "gateway/base/result.h"
#include "gateway/outputs/dds/discovery/announcement_relay.h"

namespace baudgate::dds {

class RelaySocket {
 public:
  /// `at` is IPv4. The error names the address, and what is wrong with it.
  static Result<RelaySocket> Open(const config::HostPort& at);
  ~RelaySocket();
  RelaySocket(RelaySocket&& other) noexcept;
  RelaySocket& operator=(RelaySocket&&) = delete;

  /// Has something to read when a datagram has come.
  int descriptor() const { return descriptor_; }
  /// Takes what has come, a bounded number of datagrams. What is refused goes to the log, folded.
  void Take(AnnouncementRelay& relay);

 private:
  explicit RelaySocket(int descriptor) : descriptor_(descriptor) {}
  void Send(const Introduction& introduction) const;

  int descriptor_ = -1;
};

}  // namespace baudgate::dds
