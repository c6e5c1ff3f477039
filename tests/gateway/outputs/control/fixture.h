// `ControlTest`: a gateway (tests/gateway/outputs/status/two_lines.h) with a control server.
// `FakeLines` records its calls.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <condition_variable>
#include <filesystem>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "gateway/outputs/control/control_server.h"
#include "tests/gateway/outputs/status/two_lines.h"
#include "tests/support/raw_client.h"

namespace baudgate::control {

inline constexpr const char* kStatus = R"({"command":"status"})";
inline constexpr const char* kTrace = R"({"command":"trace","target":"bay-1"})";

class FakeLines final : public lines::LineControl, public bus::CommandSink {
 public:
  explicit FakeLines(bus::PointStore& store) : store_(store) {}

  void Release(std::uint32_t line, Duration time) override;
  void Offer(std::uint32_t line, config::PortServer server, Duration time) override;
  void TakeBack(std::uint32_t line) override;
  void SetInUse(std::uint32_t device, bool in_use, const std::string& by) override;
  std::shared_ptr<records::TraceQueue> Trace(std::uint32_t line,
                                             std::function<void()> wake) override;
  std::vector<records::TraceRecord> Recorded(std::uint32_t line) override;
  const protocols::Protocol* FindProtocol(const std::string&) const override { return protocol; }

  bool Submit(bus::WriteCommand command) override;
  void OnNotTaken(const bus::DeniedWrite& denied) override;

  WriteResult result{.read_back = true};
  std::promise<bus::WriteCommand>* hold = nullptr;  ///< if set: takes the next command
  bool full = false;
  const protocols::Protocol* protocol = nullptr;

  bool Push(std::uint32_t line, const records::TraceRecord& record);
  bool WaitForTraces(std::uint32_t line, std::size_t count);
  std::vector<std::string> calls();

  std::vector<records::TraceRecord> recorded;

 private:
  std::size_t Traces(std::uint32_t line);
  void Note(const std::string& call);

  bus::PointStore& store_;
  std::mutex mutex_;
  std::vector<std::string> calls_;
  std::map<std::uint32_t, std::vector<std::weak_ptr<records::TraceQueue>>> traces_;
};

inline std::string Ask(const RawClient& client, const std::string& request) {
  client.Send(request + "\n");
  return client.ReceiveLine().value_or("(no answer)");
}

class RuntimeDirectory {
 public:
  explicit RuntimeDirectory(const std::filesystem::path& path);
  ~RuntimeDirectory();

 private:
  std::string before_;
};

class ControlTest : public ::testing::Test {
 protected:
  explicit ControlTest(config::Config config = status::TwoLines());
  ~ControlTest() override;

  void StartServer() { StartServerWith({"1.2.3", status::kStarted}); }
  void StartServerWith(status::GatewayInfo info);
  void StopServer();
  RawClient Connect() const { return RawClient(path()); }
  std::string path() const { return config_.socket; }

  std::filesystem::path directory_;
  config::Config config_;
  bus::PointStore store_{config_};
  FakeLines lines_{store_};
  Limits limits_;
  asio::io_context io_{1};
  std::optional<ControlServer> server_;
  Status listening_;

 private:
  std::thread thread_;
};

}  // namespace baudgate::control
