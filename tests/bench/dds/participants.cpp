// Benchmark: cost of subscribers that join, leave, are killed or stopped, or never acknowledge, for
// the DDS process of a gateway with 100 points.
// SPDX-License-Identifier: Apache-2.0
#include <fastdds/rtps/transport/test_UDPv4TransportDescriptor.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <filesystem>
#include <fstream>
#include <thread>
#include <utility>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/fast/types.h"
#include "gateway/outputs/dds/samples.h"
#include "tests/bench/dds/bench.h"

namespace baudgate::bench {
namespace {

namespace fs = std::filesystem;
namespace fast = eprosima::fastdds::dds;
constexpr int kDomain = 66;
constexpr int kPoints = 100;
constexpr int kMostOfAMachine = 119;

std::string Yaml() {
  std::string yaml = fmt::format(
      "gateway: {{ name: crowded }}\nmodbus: {{ listen: \"127.0.0.1:15998\" }}\n"
      "dds: {{ domain: {}, heartbeat: 1s }}\nlines:\n  - name: line\n    port: /nonexistent/tty\n"
      "    protocol: spabus\n    devices:\n      - name: relay\n        address: 1\n"
      "        unit: 1\n        poll: 1s\n        points:\n",
      kDomain);
  for (int i = 1; i <= kPoints; ++i) {
    yaml += fmt::format("          - {{ name: v{0}, read: V{0}, type: float32, modbus: {1} }}\n", i,
                        2 * (i - 1));
  }
  return yaml;
}

pid_t ChildOf(pid_t parent) {
  std::error_code error;
  for (const auto& task : fs::directory_iterator(fmt::format("/proc/{}/task", parent), error)) {
    std::ifstream children(task.path() / "children");
    if (pid_t child = 0; children >> child) return child;
  }
  return 0;
}

/// Opens a reader of all points in a new participant. A `deaf` reader never acknowledges. The
/// readers ignore each other, because only the gateway is measured.
fast::DataReader* OpenReader(bool deaf) {
  auto transport = std::make_shared<eprosima::fastdds::rtps::test_UDPv4TransportDescriptor>();
  transport->interfaceWhiteList = {"127.0.0.1"};
  if (deaf) transport->dropAckNackMessagesPercentage = 100;
  fast::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  auto& builtin = qos.wire_protocol().builtin;
  builtin.mutation_tries = kMostOfAMachine;
  builtin.discovery_config.leaseDuration = {3, 0};
  builtin.discovery_config.leaseDuration_announcementperiod = {1, 300'000'000};
  builtin.discovery_config.ignoreParticipantFlags = eprosima::fastrtps::rtps::FILTER_SAME_PROCESS;
  auto* participant =
      fast::DomainParticipantFactory::get_instance()->create_participant(kDomain, qos);
  if (participant == nullptr) return nullptr;
  const fast::TypeSupport type(dds::NewPointType());
  type.register_type(participant);
  auto* topic =
      participant->create_topic(dds::kPointTopic, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  auto* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  fast::DataReaderQos reader;
  reader.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  reader.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  reader.resource_limits().max_instances = reader.resource_limits().max_samples = 1000;
  reader.resource_limits().max_samples_per_instance = 1;
  return subscriber->create_datareader(topic, reader);
}

void Leave(fast::DataReader* reader) {
  auto* participant =
      const_cast<fast::DomainParticipant*>(reader->get_subscriber()->get_participant());
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
}

bool IsWhole(fast::DataReader* reader) {
  return reader->get_unread_count() >= static_cast<std::uint64_t>(kPoints);
}

class Table {
 public:
  explicit Table(pid_t daemon) : daemon_(daemon) {}
  /// Prints one row: processor time of the DDS process during `time`, and its memory at the end.
  void Row(const std::string& what, std::chrono::seconds time) {
    const pid_t process = ChildOf(daemon_);
    const double before = ProcessorOf(process);
    double most = 0;
    double last = before;
    for (std::chrono::seconds gone{}; gone < time; gone += 1s) {
      std::this_thread::sleep_for(1s);
      const double now = ProcessorOf(process);
      most = std::max(most, now - last);
      last = now;
    }
    const long resident = ResidentOf(process);
    if (first_ == 0) first_ = resident;
    const pid_t earlier = std::exchange(process_, process);
    const char* again = earlier != 0 && earlier != process ? " (a new process)" : "";
    fmt::print("| {}{} | {:.3f} | {:.2f} | {} | {:+} |\n", what, again,
               (last - before) / static_cast<double>(time.count()), most, resident,
               resident - first_);
    std::fflush(stdout);
  }

 private:
  const pid_t daemon_;
  pid_t process_ = 0;
  long first_ = 0;
};

pid_t Join(int count, const std::string& kind) {
  const std::string ready = fmt::format("/tmp/baudgate-participants-{}", ::getpid());
  fs::remove(ready);
  const pid_t child = Start({"be-subscribers", std::to_string(count), kind, ready});
  for (int i = 0; i < 1200 && !fs::exists(ready); ++i) std::this_thread::sleep_for(100ms);
  if (!fs::exists(ready)) fmt::print("(not all of {} came in)\n", count);
  fs::remove(ready);
  return child;
}

}  // namespace

int BeSubscribers(const std::vector<std::string>& words) {
  const int count = std::stoi(words.at(1));
  // On other machines the subscribers would not use the gateway's processors, so their priority is
  // low.
  [[maybe_unused]] const int nice = ::nice(19);
  const bool deaf = words.at(2) == "deaf";
  sigset_t stop;
  sigemptyset(&stop);
  sigaddset(&stop, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &stop, nullptr);
  std::vector<fast::DataReader*> readers;
  for (int i = 0; i < count; ++i) {
    readers.push_back(OpenReader(deaf));
    if (readers.back() == nullptr) return 4;
    // The gateway accepts at most eight new participants a second from one address.
    std::this_thread::sleep_for(150ms);
  }
  // A reader that never acknowledges cannot request earlier samples, so it is not waited for.
  while (!deaf && !std::ranges::all_of(readers, IsWhole)) std::this_thread::sleep_for(50ms);
  std::ofstream(words.at(3)) << count;
  int number = 0;
  sigwait(&stop, &number);
  for (fast::DataReader* reader : readers) Leave(reader);
  return 0;
}

void RunParticipants(const std::string& baudgate, int count) {
  const std::string directory = fmt::format("/tmp/baudgate-crowd-{}", ::getpid());
  fs::create_directory(directory);
  std::ofstream(directory + "/baudgate.yaml") << Yaml();
  const pid_t daemon = ::fork();
  if (daemon == 0) {
    ::execl(baudgate.c_str(), "baudgate", "run", "-c", (directory + "/baudgate.yaml").c_str(),
            nullptr);
    ::_exit(127);
  }
  for (int i = 0; i < 100 && ChildOf(daemon) == 0; ++i) {
    std::this_thread::sleep_for(100ms);
  }
  fmt::print("participants: {} points, each sent once a second; {} subscribers\n\n", kPoints,
             count);
  fmt::print("| | of a core | dearest second | VmRSS, KiB | to the beginning |\n");
  fmt::print("| --- | --- | --- | --- | --- |\n");
  Table table(daemon);
  table.Row("alone", 10s);
  pid_t crowd = Join(count, "normal");
  table.Row("joined", 10s);
  End(crowd, SIGTERM);
  table.Row("left", 10s);
  crowd = Join(count, "normal");
  table.Row("joined again", 10s);
  End(crowd, SIGKILL);
  table.Row("killed", 10s);
  table.Row("10 s later", 10s);
  crowd = Join(count, "normal");
  ::kill(crowd, SIGSTOP);
  table.Row("stopped", 10s);
  ::kill(crowd, SIGCONT);
  table.Row("going on", 20s);
  End(crowd, SIGTERM);
  table.Row("left", 10s);
  crowd = Join(count, "deaf");
  table.Row("never acknowledge", 30s);
  End(crowd, SIGKILL);
  table.Row("killed", 30s);
  End(daemon, SIGTERM);
  fs::remove_all(directory);
}

}  // namespace baudgate::bench
