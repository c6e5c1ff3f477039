// Tests several programs that write to one device at once.
// SPDX-License-Identifier: Apache-2.0
#include "tests/system/writers.h"

#include <gmock/gmock.h>

#include <atomic>
#include <latch>
#include <map>
#include <sstream>
#include <thread>

#include "tests/system/tapped_cable.h"

namespace baudgate::system_test {
namespace {

constexpr const char* kAddress = "1F";

using Writes = std::vector<std::string>;

class Writers : public RouteStation {
 protected:
  struct Part {
    std::unique_ptr<Writer> writer;
    std::vector<WriteStep> steps{};
    std::vector<Told> told{};
  };

  std::string Yaml() const {
    std::string yaml = RouteStation::Yaml(
        {}, Line("io", "dcon",
                 std::string("address: 0x") + kAddress +
                     ", profile: icpdas-i-7024, unit: 1, poll: 1s, slow: 1h, write: allow"));
#ifdef CYCLONE_WRITER
    const std::string off = "enabled: false";
    yaml.replace(yaml.find(off), off.size(),
                 "domain: " + std::to_string(domain()) + ", write: allow");
#endif
    return yaml;
  }

  RunPymodbus Pymodbus() const {
    return [this](const std::vector<std::string>& commands) {
      return RouteStation::Pymodbus("tcp", std::to_string(port()), 1, commands);
    };
  }
  RunOnce Mbpoll() const {
    return [this](const WriteStep& step) {
      return MbpollTcp("1", {"-r", std::to_string(step.address), "-t", "4:float", "-B", "-o", "10"},
                       {step.value});
    };
  }
  RunOnce Baudgate() const {
    return [this](const WriteStep& step) {
      return Ask({"write", "io.io-1." + step.point, step.value});
    };
  }

#ifdef CYCLONE_WRITER
  RunOnce Cyclone() const {
    return [this, seq = 0](const WriteStep& step) mutable {
      Finished asked = RunToEnd({CYCLONE_WRITER, "--domain", std::to_string(domain()), "--gateway",
                                 gateway(), "--client", "plc-1", "--seq", std::to_string(++seq),
                                 "--device", "io-1", "--point", step.point, "--text", step.value},
                                directory());
      const std::string told = std::to_string(seq) + " ";
      const bool confirmed = asked.output.find("\n" + told + "ok") != std::string::npos;
      const bool denied = asked.output.find("\n" + told + "denied") != std::string::npos;
      asked.code = confirmed ? 0 : denied ? 1 : 2;
      return asked;
    };
  }
#endif

  /// Runs all writers. Each does `count` writes; the first `quick` writers go on until the others
  /// have ended.
  static void RunAll(std::vector<Part>& parts, std::size_t quick, int count) {
    constexpr int kMost = 999;
    std::latch start(std::ssize(parts));
    std::atomic<std::size_t> slow = parts.size() - quick;
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      threads.emplace_back([&, i] {
        Part& part = parts[i];
        start.arrive_and_wait();
        do {
          std::vector<WriteStep> steps;
          for (int k = 0; k < count && std::ssize(part.steps) + k < kMost; ++k) {
            steps.push_back(
                StepOf(static_cast<int>(i) + 1, static_cast<int>(part.steps.size()) + k + 1));
          }
          const auto told = part.writer->Write(steps);
          part.steps.insert(part.steps.end(), steps.begin(), steps.end());
          part.told.insert(part.told.end(), told.begin(), told.end());
        } while (i < quick && slow > 0 && part.steps.size() < kMost);
        if (i >= quick) --slow;
      });
    }
    for (std::thread& thread : threads) thread.join();
  }

  static Writes OnTheWire(const TappedCable& cable) {
    const std::string begin = std::string("#") + kAddress;
    Writes writes;
    for (const std::string& request : cable.Requests()) {
      if (!request.starts_with(begin) || request.size() == begin.size()) continue;
      std::string value = request.substr(begin.size() + 2);
      value.erase(0, value[0] == '0' ? 1 : 0);
      writes.push_back(std::string("output_") + request[begin.size()] + " " + value);
    }
    return writes;
  }

  std::vector<Json> Records() const {
    const Finished writes = Ask({"writes", "--json"});
    EXPECT_EQ(writes.code, 0) << writes.errors;
    std::vector<Json> records;
    std::istringstream lines(writes.output);
    for (std::string line; std::getline(lines, line);) records.push_back(Json::parse(line));
    return records;
  }
  static Writes Confirmed(const std::vector<Json>& records) {
    Writes writes;
    for (const Json& record : records) {
      if (record["kind"] != "point") continue;
      EXPECT_EQ(record["outcome"], "ok") << record;
      char value[16];
      std::snprintf(value, sizeof value, "%.3f", record["new"].get<double>());
      writes.push_back(record["point"].get<std::string>() + " " + value);
    }
    return writes;
  }
  static int Denied(const std::vector<Json>& records) {
    int denied = 0;
    for (const Json& record : records) {
      if (record["kind"] == "denied") denied += record["count"].get<int>();
    }
    return denied;
  }
};

TEST_F(Writers, OfEveryKindWriteCorrectlyAtOnce) {
  const auto twin = StartTwin("module", "icpdas-i-7024", std::string("0x") + kAddress);
  const TappedCable cable(LinkOf("io"), LinkOf("module"));
  ASSERT_TRUE(cable.connected());
  const auto daemon = StartGateway(Yaml(), {"io"});
  ModbusClient reader(port());
  ASSERT_TRUE(Eventually([&] { return reader.Float(1, 0).has_value(); })) << daemon->Errors();

  constexpr int kCount = 15;
  constexpr std::size_t kQuick = 2;
  std::vector<Part> parts;
  parts.push_back({LibmodbusWriter(port())});
  parts.push_back({RawWriter(port())});
  parts.push_back({PymodbusWriter(Pymodbus())});
  parts.push_back({ProgramWriter("mbpoll", 1, Mbpoll())});
  parts.push_back({ProgramWriter("baudgate write", 1, Baudgate())});
#ifdef CYCLONE_WRITER
  parts.push_back({ProgramWriter("Cyclone DDS", 1, Cyclone())});
#endif
  RunAll(parts, kQuick, kCount);

  int forbidden = 0;
  std::map<std::string, Writes> allowed;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Part& part = parts[i];
    const std::string name = part.writer->name();
    ASSERT_GE(part.steps.size(), static_cast<std::size_t>(kCount)) << name;
    ASSERT_EQ(part.told.size(), part.steps.size()) << name << ": one answer to each";
    for (std::size_t k = 0; k < part.steps.size(); ++k) {
      const WriteStep& step = part.steps[k];
      EXPECT_EQ(part.told[k], step.allowed ? Told::confirmed : Told::refused)
          << name << ": " << step.point << " " << step.value;
      forbidden += step.allowed ? 0 : 1;
      if (step.allowed) allowed[std::to_string(i + 1)].push_back(step.point + " " + step.value);
    }
  }

  const Writes wire = OnTheWire(cable);
  std::map<std::string, Writes> told;
  for (const std::string& write : wire) {
    told[write.substr(write.find(' ') + 1, write.find('.') - write.find(' ') - 1)].push_back(write);
  }
  EXPECT_EQ(told, allowed) << "each in its order, and nothing else";
  ASSERT_TRUE(Eventually([&] { return Denied(Records()) == forbidden; }))
      << Denied(Records()) << " of " << forbidden;
  EXPECT_EQ(Confirmed(Records()), wire) << "the audit says what the module was told";
  std::size_t turns = 0;
  for (std::size_t i = 1; i < wire.size(); ++i) {
    turns += wire[i][wire[i].find(' ') + 1] != wire[i - 1][wire[i - 1].find(' ') + 1] ? 1 : 0;
  }
  EXPECT_GT(turns, parts.size()) << "they have not written at once";
  std::cout << wire.size() << " writes, " << forbidden << " refused, " << turns
            << " changes from one client to another\n";
}

}  // namespace
}  // namespace baudgate::system_test
