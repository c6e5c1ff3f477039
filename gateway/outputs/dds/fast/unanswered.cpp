// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/unanswered.h"

#include <algorithm>

#include "gateway/outputs/dds/fast/participant.h"

namespace baudgate::dds {
namespace {

constexpr char kLoopback[] = "127.0.0.1";

/// Which of the addresses that a participant of this machine may use are not ours yet.
std::string Missing(const std::string& host, const std::vector<std::string>& interfaces) {
  const auto lacks = [&](const std::string& address) {
    return !MeansAll(interfaces) && std::ranges::find(interfaces, address) == interfaces.end();
  };
  std::string missing;
  if (lacks(kLoopback)) missing = kLoopback;
  if (host != kLoopback && lacks(host)) missing += (missing.empty() ? "" : " and ") + host;
  return missing;
}

std::string Cure(const std::string& host, bool on_this_machine,
                 const std::vector<std::string>& interfaces) {
  if (!on_this_machine) {
    return "name the address of this machine in its network in dds.interfaces";
  }
  const std::string missing = Missing(host, interfaces);
  if (!missing.empty()) {
    return "it is on this machine, so name " + missing + " in dds.interfaces as well";
  }
  return "it is on this machine and must use an address of dds.interfaces beside 127.0.0.1";
}

}  // namespace

std::string UnansweredRemark(const std::string& host, bool on_this_machine,
                             const std::vector<std::string>& interfaces) {
  return host + " was heard and cannot be answered: " + Cure(host, on_this_machine, interfaces);
}

}  // namespace baudgate::dds
