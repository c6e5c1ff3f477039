// Soak of DDS discovery without multicast (packaging/soak.sh discovery): gateways, a subscriber and
// two discovery servers or peers are killed in turn. Measures the time until the subscriber has
// every point again, and prints the slowest times.
// Environment: BAUDGATE_SOAK_ROUNDS, _GATEWAYS, _POINTS (of each gateway), _BY (servers, peers),
// _DOMAIN, _IDLE (seconds of idle time afterwards, whose cost is measured).
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "gateway/outputs/dds/fast/fast_writer.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "tests/soak/role.h"

namespace baudgate::dds {
namespace {

using soak::Now;
using soak::Number;
using soak::Role;

constexpr Duration kPatience = 30s;

struct Plan {
  std::size_t rounds = Number("ROUNDS", 5);
  std::size_t gateways = Number("GATEWAYS", 3);
  std::size_t points = Number("POINTS", 20);
  std::size_t idle = Number("IDLE", 0);
  bool by_servers = soak::Setting("BY", "servers") == "servers";
  int domain = static_cast<int>(Number("DOMAIN", 100 + static_cast<std::size_t>(::getpid()) % 100));
  std::uint16_t port = static_cast<std::uint16_t>(20000 + 2 * (::getpid() % 5000));

  ParticipantOptions Participant() const {
    ParticipantOptions options;
    options.domain = domain;
    options.interfaces = {"127.0.0.1"};
    options.multicast = false;
    if (by_servers) {
      options.discovery_servers = {{"127.0.0.1", port},
                                   {"127.0.0.1", static_cast<std::uint16_t>(port + 1)}};
    } else {
      options.peers = {"127.0.0.1"};
    }
    return options;
  }
};

/// Publishes `life` in all points, then 100 samples a second; 1 a second if idle time is measured.
void BeGateway(const Plan& plan, std::size_t which, std::size_t life) {
  auto writer = CreateFastWriter(plan.Participant(),
                                 {.points = static_cast<std::uint32_t>(plan.points), .devices = 1});
  if (!writer) {
    std::fprintf(stderr, "%s\n", writer.error().c_str());
    return;
  }
  PointSample sample;
  sample.gateway = "gateway-" + std::to_string(which);
  sample.device = "d";
  sample.value = static_cast<double>(life);
  for (std::size_t i = 0;; ++i) {
    sample.point = "p" + std::to_string(i % plan.points);
    sample.seq = i;
    (*writer)->Write(sample);
    if (i >= plan.points) {
      std::this_thread::sleep_for(plan.idle == 0 ? 10ms : 1000ms);
    } else if (i % 20 == 19) {
      std::this_thread::sleep_for(1ms);
    }
  }
}

void BeSubscriber(const Plan& plan, int to) {
  struct Seen {
    std::set<std::string> points;
    std::size_t samples = 0;
  };
  std::map<std::pair<std::string, double>, Seen> all;
  SubscriberOptions options;
  options.participant = plan.Participant();
  SubscriberCallbacks callbacks;
  callbacks.on_point = [&](const PointSample& sample, const Origin&) {
    Seen& seen = all[{sample.gateway, sample.value}];
    const std::size_t each = plan.idle == 0 ? 10 : 1;
    const bool was_whole = seen.points.size() == plan.points;
    seen.points.insert(sample.point);
    if (seen.points.size() != plan.points || (was_whole && ++seen.samples % each != 0)) return;
    const std::string line =
        sample.gateway + " " + std::to_string(static_cast<int>(sample.value)) + "\n";
    [[maybe_unused]] const auto written = ::write(to, line.data(), line.size());
  };
  const auto subscriber = DdsSubscriber::Create(options, callbacks);
  if (!subscriber) std::fprintf(stderr, "%s\n", subscriber.error().c_str());
  for (;;) ::pause();
}

class Domain {
 public:
  explicit Domain(const Plan& plan) : plan_(plan), gateways_(plan.gateways), lives_(plan.gateways) {
    for (std::size_t i = 0; plan_.by_servers && i < 2; ++i) StartServer(i);
    for (std::size_t i = 0; i < plan_.gateways; ++i) StartGateway(i);
    StartSubscriber();
  }

  void StartServer(std::size_t which) {
    if (!plan_.by_servers) return;
    servers_[which].reset();
    servers_[which] = std::make_unique<Role>([this, which] {
      const std::string at = "127.0.0.1:" + std::to_string(plan_.port + which);
      ::execl(BAUDGATE_BINARY, "baudgate", "discovery-server", "--listen", at.c_str(), nullptr);
    });
  }
  void StartGateway(std::size_t which) {
    gateways_[which].reset();
    const std::size_t life = ++lives_[which];
    gateways_[which] =
        std::make_unique<Role>([this, which, life] { BeGateway(plan_, which, life); });
  }
  void StartSubscriber() {
    subscriber_.reset();
    if (news_ >= 0) ::close(news_);
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    subscriber_ = std::make_unique<Role>([this, end = ends[1]] { BeSubscriber(plan_, end); });
    ::close(ends[1]);
    news_ = ends[0];
    rest_.clear();
  }

  /// Returns the time until all points of all running gateways are received, and after that a new
  /// sample of each gateway.
  Duration Whole() {
    heard_.clear();
    DropNews();
    const Instant begun = Now();
    while (!IsWhole() && Now() - begun < kPatience) {
      pollfd waited{news_, POLLIN, 0};
      if (::poll(&waited, 1, 100) > 0) Read();
    }
    return IsWhole() ? Now() - begun : kPatience;
  }

  void TellCosts() const {
    const std::uint64_t bytes = soak::LoopbackBytes();
    const double used = servers_[0] ? servers_[0]->ProcessorSeconds() : 0;
    std::this_thread::sleep_for(std::chrono::seconds(plan_.idle));
    const double seconds = static_cast<double>(plan_.idle);
    std::printf("%zu gateways at rest: %.0f bytes a second on loopback; a gateway %zu KiB\n",
                plan_.gateways, static_cast<double>(soak::LoopbackBytes() - bytes) / seconds,
                gateways_[0]->MemoryKiB());
    if (!servers_[0]) return;
    std::printf("a server: %.4f of a core, %zu KiB\n",
                (servers_[0]->ProcessorSeconds() - used) / seconds, servers_[0]->MemoryKiB());
  }

 private:
  void DropNews() {
    for (pollfd waited{news_, POLLIN, 0}; ::poll(&waited, 1, 0) > 0;) Read();
    heard_.clear();
  }
  void Read() {
    char bytes[4096];
    const ssize_t count = ::read(news_, bytes, sizeof bytes);
    if (count <= 0) FAIL() << "the subscriber has ended";
    rest_.append(bytes, static_cast<std::size_t>(count));
    for (auto end = rest_.find('\n'); end != std::string::npos; end = rest_.find('\n')) {
      heard_.insert(rest_.substr(0, end));
      rest_.erase(0, end + 1);
    }
  }
  bool IsWhole() const {
    for (std::size_t i = 0; i < lives_.size(); ++i) {
      if (!heard_.contains("gateway-" + std::to_string(i) + " " + std::to_string(lives_[i]))) {
        return false;
      }
    }
    return true;
  }

  const Plan& plan_;
  std::unique_ptr<Role> servers_[2];
  std::vector<std::unique_ptr<Role>> gateways_;
  std::vector<std::size_t> lives_;
  std::unique_ptr<Role> subscriber_;
  int news_ = -1;
  std::set<std::string> heard_;
  std::string rest_;
};

std::string KillInTurn(Domain& domain, const Plan& plan, std::size_t round) {
  const std::size_t gateway = round % plan.gateways;
  if (!plan.by_servers) {
    round % 2 == 0 ? domain.StartGateway(gateway) : domain.StartSubscriber();
    return round % 2 == 0 ? "a gateway" : "the subscriber";
  }
  const std::size_t kind = round % 5;
  if (kind == 0) domain.StartServer(round % 2);
  if (kind >= 3) {
    domain.StartServer(0);
    domain.StartServer(1);
  }
  if (kind == 1 || kind == 4) domain.StartGateway(gateway);
  if (kind == 2 || kind == 3) domain.StartSubscriber();
  constexpr const char* kKinds[] = {"a server", "a gateway", "the subscriber",
                                    "both servers and the subscriber",
                                    "both servers and a gateway"};
  return kKinds[kind];
}

TEST(DiscoverySoak, AllGatewaysAreSeenAgainAfterEachKill) {
  const Plan plan;
  Domain domain(plan);
  const Duration begun = domain.Whole();
  ASSERT_LT(begun, kPatience) << "it has not begun";
  std::printf("%-32s %s\n", "begun", FormatDuration(begun / 1ms * 1ms).c_str());
  std::map<std::string, std::vector<Duration>> times;
  for (std::size_t round = 0; round < plan.rounds; ++round) {
    const std::string what = KillInTurn(domain, plan, round);
    const Duration took = domain.Whole() / 1ms * 1ms;
    std::printf("%3zu %-32s %s\n", round, what.c_str(), FormatDuration(took).c_str());
    std::fflush(stdout);
    times[what].push_back(took);
    // The time depends on the machine, so it is only printed.
    EXPECT_LT(took, kPatience) << what;
  }
  for (auto& [what, all] : times) {
    std::ranges::sort(all);
    std::printf("%zu times %s: half within %s, slowest %s\n", all.size(), what.c_str(),
                FormatDuration(all[all.size() / 2]).c_str(), FormatDuration(all.back()).c_str());
  }
  if (plan.idle > 0) domain.TellCosts();
}

}  // namespace
}  // namespace baudgate::dds
