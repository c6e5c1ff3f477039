// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/outputs/dds/own_network.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/rtnetlink.h>
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <string>

#include "gateway/outputs/dds/fast/own_network.h"

namespace baudgate::dds::testing {
namespace {

const std::string kInterface = "cable0";

void Ip(const std::string& words) {
  EXPECT_EQ(std::system(("ip " + words).c_str()), 0) << "ip " << words;
}

int InterfaceNews() {
  const int news = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE);
  sockaddr_nl wanted{};
  wanted.nl_family = AF_NETLINK;
  wanted.nl_groups = RTMGRP_LINK | RTMGRP_IPV4_IFADDR;
  EXPECT_EQ(::bind(news, reinterpret_cast<const sockaddr*>(&wanted), sizeof wanted), 0);
  return news;
}

void AwaitInterface(const std::string& address, bool up) {
  constexpr int kLimit = 10'000;
  const auto is_up = [&address] {
    const OwnAddresses own = FindOwnAddresses();
    const auto at = own.find(address);
    return at != own.end() && at->second;
  };
  pollfd news{InterfaceNews(), POLLIN, 0};
  std::array<char, 8192> told{};
  while (is_up() != up && ::poll(&news, 1, kLimit) > 0) {
    while (::recv(news.fd, told.data(), told.size(), 0) > 0) {
    }
  }
  ::close(news.fd);
  EXPECT_EQ(is_up(), up) << address;
}

int CurrentNetwork() { return ::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC); }

/// Users other than root may create a network only inside a user namespace, where they are root.
bool BecomeRoot() {
  const uid_t user = ::geteuid();
  if (user == 0) return true;
  if (::unshare(CLONE_NEWUSER) != 0) return false;
  std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
  return true;
}

int NewNetwork() {
  if (::unshare(CLONE_NEWNET) != 0) return -1;
  Ip("link set lo up");
  return CurrentNetwork();
}

}  // namespace

OwnNetwork::OwnNetwork() : before_(CurrentNetwork()) {
  if (!BecomeRoot()) return;
  here_ = NewNetwork();
  if (here_ >= 0) there_ = NewNetwork();
  if (!ok()) return;
  ComeBack();
  AddCable();
}

OwnNetwork::~OwnNetwork() {
  ::setns(before_, CLONE_NEWNET);
  for (const int network : {before_, here_, there_}) {
    if (network >= 0) ::close(network);
  }
}

void OwnNetwork::GoThere() const { EXPECT_EQ(::setns(there_, CLONE_NEWNET), 0); }
void OwnNetwork::ComeBack() const { EXPECT_EQ(::setns(here_, CLONE_NEWNET), 0); }

void OwnNetwork::AddCable() const {
  const std::string there = "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(there_);
  Ip("link add " + kInterface + " type veth peer name " + kInterface + " netns " + there);
  Ip("address add " + std::string(kHere) + "/24 dev " + kInterface);
  Ip("link set " + kInterface + " up");
  GoThere();
  Ip("address add " + std::string(kThere) + "/24 dev " + kInterface);
  ComeBack();
  PlugIn();
}

void OwnNetwork::PlugIn() const {
  GoThere();
  Ip("link set " + kInterface + " up");
  AwaitInterface(kThere, true);
  ComeBack();
  AwaitInterface(kHere, true);
}

void OwnNetwork::Unplug() const {
  GoThere();
  Ip("link set " + kInterface + " down");
  ComeBack();
  AwaitInterface(kHere, false);
}

void OwnNetwork::RemoveCable() const { Ip("link delete " + kInterface); }

}  // namespace baudgate::dds::testing
