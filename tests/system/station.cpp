// SPDX-License-Identifier: Apache-2.0
#include "tests/system/station.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <stddef.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <fstream>
#include <iostream>
#include <sstream>

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;

constexpr int kQualityOffset = 20000;

/// Reserves a number among all test processes while the descriptor is open; negative: in use.
int Claim(const std::string& what, int number) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = "baudgate-test-" + what + "-" + std::to_string(number);
  name.copy(address.sun_path + 1, sizeof address.sun_path - 1);  // an abstract socket is not a file
  const int descriptor = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  if (::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), size) == 0) return descriptor;
  ::close(descriptor);
  return -1;
}

bool CanBind(std::uint16_t port) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool bound =
      ::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  ::close(descriptor);
  return bound;
}

bool CanOpen(const std::string& port) {
  const int descriptor = ::open(port.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return false;
  ::close(descriptor);
  return true;
}

void ReplaceSimulate(std::string& line, std::size_t at, const FixedValues& values,
                     const std::string& point) {
  const std::size_t begin = at + std::string("simulate: ").size();
  const bool list = line[begin] == '[';
  const std::size_t end = list ? line.find(']', begin) + 1 : line.find_first_of(",}", begin);
  const auto fixed = values.find(point);
  if (fixed != values.end()) {
    line.replace(begin, end - begin, fixed->second);
  } else if (list) {
    line.replace(begin, end - begin, line.substr(begin + 1, line.find(',', begin) - begin - 1));
  }
}

}  // namespace

std::uint16_t FreePort() {
  static int next = 12000 + static_cast<int>(::getpid() % 900) * 20;
  for (;; ++next) {
    const auto port = static_cast<std::uint16_t>(next);
    if (Claim("port", next) < 0 || !CanBind(port)) continue;
    ++next;
    return port;
  }
}

int FreeDomain() {
  constexpr int kDomains = 99;
  static int domain = static_cast<int>(::getpid() % kDomains);
  static int claim = -1;
  int next = -1;
  while (next < 0) {
    domain = 1 + domain % kDomains;
    next = Claim("domain", domain);
  }
  if (claim >= 0) ::close(claim);
  claim = next;
  return domain;
}

std::vector<Json> JsonLines(const std::string& output) {
  std::vector<Json> documents;
  std::istringstream lines(output.substr(0, output.rfind('\n') + 1));
  for (std::string line; std::getline(lines, line);) documents.push_back(Json::parse(line));
  return documents;
}

pid_t ChildOf(const Child& process) {
  std::error_code error;
  const std::string task = "/proc/" + std::to_string(process.id()) + "/task";
  for (const auto& thread : fs::directory_iterator(task, error)) {
    std::ifstream children(thread.path() / "children");
    if (pid_t child = 0; children >> child) return child;
  }
  return 0;
}

Station::Station()
    : port_(FreePort()), domain_(FreeDomain()), gateway_("test-" + std::to_string(::getpid())) {
  std::string form = (fs::temp_directory_path() / "baudgate-test-XXXXXX").string();
  if (::mkdtemp(form.data()) != nullptr) directory_ = form;
}

Station::~Station() {
  if (HasFailure()) {
    for (const auto& file : fs::directory_iterator(directory_)) {
      if (file.path().extension() != ".err") continue;
      std::cerr << "---- " << file.path().filename().string() << "\n"
                << ReadWholeFile(file.path()).substr(0, 4000);
    }
  }
  std::error_code ignored;
  fs::remove_all(directory_, ignored);
}

fs::path Station::Write(const std::string& name, const std::string& text) const {
  const fs::path file = directory_ / name;
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

void Station::PinProfile(const std::string& protocol, const std::string& shipped,
                         const std::string& name, const FixedValues& values) const {
  std::ifstream source(fs::path(SHIPPED_PROFILES) / protocol / (shipped + ".yaml"));
  ASSERT_TRUE(source) << "there is no shipped profile " << shipped;
  std::string text;
  std::string point;
  std::size_t replaced = 0;
  for (std::string line; std::getline(source, line);) {
    constexpr std::string_view kName = "- { name: ";
    if (const auto at = line.find(kName); at != std::string::npos) {
      const std::size_t begin = at + kName.size();
      point = line.substr(begin, line.find(',', begin) - begin);
    }
    if (const auto at = line.find("simulate: "); at != std::string::npos && line[0] != '#') {
      replaced += values.count(point);
      ReplaceSimulate(line, at, values, point);
    }
    text += line + "\n";
  }
  ASSERT_EQ(replaced, values.size()) << "not all of the fixed points are in " << shipped;
  Write("profiles/" + protocol + "/" + name + ".yaml", text);
}

std::string Station::Head(bool dds) const {
  std::ostringstream yaml;
  yaml << "gateway: { name: " << gateway_ << " }\n"
       << "modbus: { listen: \"127.0.0.1:" << port_ << "\" }\n"
       << "dds: { enabled: " << (dds ? "true" : "false") << ", domain: " << domain_ << " }\n"
       << "lines:\n";
  return yaml.str();
}

std::string Station::WithSocket(std::string yaml, const std::string& keys) const {
  const std::string gateway = "gateway: { ";
  return yaml.insert(yaml.find(gateway) + gateway.size(), "socket: " + socket() + ", " + keys);
}

std::string Station::Line(const std::string& name, const std::string& protocol,
                          const std::string& keys, const std::string& line_keys) const {
  return "  - name: " + name + "\n    port: " + LinkOf(name) + "\n    protocol: " + protocol +
         "\n" + (line_keys.empty() ? "" : "    " + line_keys + "\n") +
         "    devices:\n      - { name: " + name + "-1, " + keys + " }\n";
}

Child::Environment Station::Environment() const {
  // BAUDGATE_MODULES gives profiles in the test's directory precedence. Each test has its own
  // socket and state.
  return {{"BAUDGATE_MODULES", directory_.string()},
          {"XDG_RUNTIME_DIR", directory_.string()},
          {"STATE_DIRECTORY", (directory_ / "state").string()}};
}

std::unique_ptr<Child> Station::Start(std::vector<std::string> words,
                                      Child::Environment more) const {
  words.insert(words.begin(), BAUDGATE_BINARY);
  more.merge(Environment());
  return std::make_unique<Child>(words, directory_, more);
}

Finished Station::Command(std::vector<std::string> words) const {
  words.insert(words.begin(), BAUDGATE_BINARY);
  return RunToEnd(words, directory_, Environment());
}

Finished Station::Ask(std::vector<std::string> words) const {
  words.insert(words.end(), {"--socket", socket()});
  return Command(words);
}

Json Station::Status(const std::string& target) const {
  std::vector<std::string> words = {"status", "--json"};
  if (!target.empty()) words.push_back(target);
  const Finished status = Ask(words);
  EXPECT_EQ(status.code, 0) << status.errors;
  return Json::parse(status.output, nullptr, false);
}

std::unique_ptr<Child> Station::StartTwin(const std::string& line, const std::string& profile,
                                          const std::string& address,
                                          const std::vector<std::string>& more) const {
  std::vector<std::string> words = {"simulate", "--profile", profile,     "--address",
                                    address,    "--pty",     LinkOf(line)};
  words.insert(words.end(), more.begin(), more.end());
  auto twin = Start(words);
  const bool there = Eventually([&] { return !twin->Output().empty() && CanOpen(LinkOf(line)); });
  EXPECT_TRUE(there) << "no twin on " << line << ": " << twin->Errors();
  return twin;
}

std::unique_ptr<Child> Station::StartDaemon(const std::string& yaml) const {
  auto daemon = Start({"run", "-c", Write("baudgate.yaml", yaml).string()});
  ModbusClient client(port_);
  const bool up = Eventually([&] { return !daemon->Running() || client.Input(0, 9000, 1).ok(); });
  EXPECT_TRUE(up && daemon->Running()) << "the daemon does not answer: " << daemon->Errors();
  return daemon;
}

bool Station::EventuallyFloat(ModbusClient& client, int unit, int address, float value) const {
  return Eventually([&] { return client.Float(unit, address) == value; });
}

bool Station::EventuallyQuality(ModbusClient& client, int unit, int address, int quality) const {
  return Eventually([&] { return client.Register(unit, address + kQualityOffset) == quality; });
}

bool Station::EventuallyLogged(const Child& child, const std::string& text) const {
  return Eventually([&] { return child.Errors().find(text) != std::string::npos; });
}

}  // namespace baudgate::system_test
