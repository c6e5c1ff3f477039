// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/outputs/control/fixture.h"

#include <stdlib.h>

#include <asio/post.hpp>
#include <utility>

#include "tests/support/renew_store.h"

namespace baudgate::control {
namespace {

constexpr int kPatienceMs = 20'000;

}  // namespace

void FakeLines::Note(const std::string& call) {
  const std::lock_guard lock(mutex_);
  calls_.push_back(call);
}

std::vector<std::string> FakeLines::calls() {
  const std::lock_guard lock(mutex_);
  return calls_;
}

void FakeLines::Release(std::uint32_t line, Duration time) {
  Note("release " + std::to_string(line) + " for " + FormatDuration(time));
  store_.UpdateLine(line,
                    [](bus::LineStatus& status) { status.port = bus::LineStatus::Port::released; });
}

void FakeLines::Offer(std::uint32_t line, config::PortServer server, Duration time) {
  Note("offer " + std::to_string(line) + " at " + server.Address() + ", " +
       std::string(Name(server.mode)) + ", for " + FormatDuration(time));
}

void FakeLines::TakeBack(std::uint32_t line) {
  Note("take back " + std::to_string(line));
  status::SetOpen(store_, line, "serial");
}

void FakeLines::SetInUse(std::uint32_t device, bool in_use, const std::string&) {
  Note((in_use ? "use " : "do not use ") + std::to_string(device));
}

std::shared_ptr<records::TraceQueue> FakeLines::Trace(std::uint32_t line,
                                                      std::function<void()> wake) {
  auto queue = std::make_shared<records::TraceQueue>(std::move(wake));
  const std::lock_guard lock(mutex_);
  traces_[line].push_back(queue);
  return queue;
}

std::vector<records::TraceRecord> FakeLines::Recorded(std::uint32_t) { return recorded; }

bool FakeLines::Submit(bus::WriteCommand command) {
  std::string call = command.client + (command.writes().empty() ? " reads" : " writes");
  for (const std::uint32_t point : command.reads()) call += " " + std::to_string(point);
  for (const bus::PointWrite& write : command.writes()) {
    call += " " + std::to_string(write.point) + "=" + ToText(write.raw);
  }
  Note(call + " of device " + std::to_string(command.device));
  if (full) return false;
  if (hold != nullptr) {
    hold->set_value(std::move(command));
    return true;
  }
  command.done(result);
  return true;
}

void FakeLines::OnNotTaken(const bus::DeniedWrite& denied) {
  Note(denied.client + " may not write " + ToText(denied.value) + ": " + denied.reason);
}

bool FakeLines::Push(std::uint32_t line, const records::TraceRecord& record) {
  const std::lock_guard lock(mutex_);
  bool taken = false;
  for (const auto& weak : traces_[line]) {
    const auto queue = weak.lock();
    if (queue) queue->Push(record);
    taken = taken || queue;
  }
  return taken;
}

std::size_t FakeLines::Traces(std::uint32_t line) {
  const std::lock_guard lock(mutex_);
  std::size_t living = 0;
  for (const auto& weak : traces_[line]) living += weak.expired() ? 0 : 1;
  return living;
}

bool FakeLines::WaitForTraces(std::uint32_t line, std::size_t count) {
  const Instant until = ReadClocks().instant + std::chrono::milliseconds(kPatienceMs);
  while (Traces(line) != count) {
    if (ReadClocks().instant > until) return false;
    std::this_thread::yield();
  }
  return true;
}

RuntimeDirectory::RuntimeDirectory(const std::filesystem::path& path) {
  if (const char* before = std::getenv("XDG_RUNTIME_DIR")) before_ = before;
  ::setenv("XDG_RUNTIME_DIR", path.c_str(), 1);
}

RuntimeDirectory::~RuntimeDirectory() { ::setenv("XDG_RUNTIME_DIR", before_.c_str(), 1); }

ControlTest::ControlTest(config::Config config) : config_(std::move(config)) {
  std::string form = (std::filesystem::temp_directory_path() / "baudgate-control-XXXXXX").string();
  if (::mkdtemp(form.data()) != nullptr) directory_ = form;
  config_.socket = (directory_ / "gate.sock").string();
}

ControlTest::~ControlTest() {
  StopServer();
  server_.reset();
  std::error_code ignored;
  std::filesystem::remove_all(directory_, ignored);
}

void ControlTest::StartServerWith(status::GatewayInfo info) {
  Renew(store_, config_);
  server_.emplace(config_, store_, lines_, lines_, std::move(info), io_, limits_);
  listening_ = server_->Listen();
  thread_ = std::thread([this] {
    const auto work = asio::make_work_guard(io_);
    io_.run();
  });
}

void ControlTest::StopServer() {
  if (!thread_.joinable()) return;
  asio::post(io_, [this] {
    server_->Stop();
    io_.stop();
  });
  thread_.join();
}

}  // namespace baudgate::control
