// `HostOf` returns the host of a network client. `FairPlaces` shares a limited number of places
// among hosts, so that a host with many connections cannot take the places of others.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "gateway/base/guarded.h"

namespace baudgate {

/// Returns the address of a client without its port: "192.0.2.5:502" → "192.0.2.5", "[::1]:502" →
/// "::1". A text of another form is returned as it is.
std::string AddressIn(std::string_view client);

/// Returns the host of a client: an IPv4 address, or the /64 network of an IPv6 address, because a
/// host can use every address of its network. A name that begins with no address is its own host.
///
///   192.0.2.5:40312, 192.0.2.5, [::ffff:192.0.2.5]:502   192.0.2.5
///   [2001:db8:0:7::1]:502, 2001:db8:0:7::1               2001:db8:0:7::/64
///   192.0.2.5:40312 CN=pump (4A01)                       192.0.2.5
///   user:root                                            user:root
///
std::string HostOf(std::string_view client);

/// Returns a number for the host of a client, for comparisons. Two hosts have equal numbers by
/// chance only.
std::uint64_t HostNumberOf(std::string_view client);

// `FairPlaces` counts the places that each host has taken. A host gets a place only if it has fewer
// places than `weight` times the free places, so some places always stay free for other hosts. The
// rule is "dynamic queue length thresholds" (Choudhury and Hahne, IEEE/ACM Transactions on
// Networking 6, 1998). Any thread may call it.
//
//   2048 places, weight 3: one host has at most 1536, then a second host 384
//
class FairPlaces {
 public:
  explicit FairPlaces(std::size_t places) : places_(places) {}

  /// Takes a place. `more`: additional places that only requests of this kind can use. Returns
  /// false if the host has its share already.
  bool Take(std::uint64_t host, std::size_t weight, std::size_t more = 0) {
    const MutexLock lock(mutex_);
    const std::size_t all = places_ + more;
    const auto own = hosts_.find(host);
    const std::size_t has = own == hosts_.end() ? 0 : own->second;
    if (taken_ >= all || has >= weight * (all - taken_)) return false;
    ++taken_;
    ++hosts_[host];
    return true;
  }
  /// Gives a place of the host back.
  void Give(std::uint64_t host) {
    const MutexLock lock(mutex_);
    const auto own = hosts_.find(host);
    if (own == hosts_.end()) return;
    --taken_;
    if (--own->second == 0) hosts_.erase(own);
  }

 private:
  const std::size_t places_;
  Mutex mutex_;
  std::size_t taken_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::map<std::uint64_t, std::size_t> hosts_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate
