// The fixture of serial port tests: a port on a pty, its far end, and a recording listener.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <asio/posix/stream_descriptor.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "gateway/tools/simulate/pty.h"
#include "tests/transports/far_end.h"
#include "transports/serial_port.h"

namespace baudgate::transports {

namespace fs = std::filesystem;
using Far = test::FarEnd<asio::posix::stream_descriptor>;

class SerialPortTest : public testing::Test {
 protected:
  SerialPortTest() {
    std::string pattern = (fs::temp_directory_path() / "baudgate-port-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    link_ = (folder_ / "line").string();
    serial_.data_bits = 7;
    serial_.parity = config::Parity::even;
    Plug();
  }
  ~SerialPortTest() override {
    port_.reset();
    fs::remove_all(folder_);
  }

  void Plug() {
    fs::remove(link_);
    auto pty = tools::Pty::Create(link_);
    ASSERT_TRUE(pty.ok()) << pty.error();
    pty_.emplace(std::move(*pty));
    far_.emplace(asio::posix::stream_descriptor(io_, pty_->TakeMaster()));
    if (!stalled_) far_->Start();
  }
  void Unplug() {
    pty_->Unplug();
    far_->stream().close();
  }
  void Open() {
    if (!port_) port_ = MakeSerialPort(link_, serial_, io_, listener_);
    const int before = listener_.opened;
    port_->Open();
    EXPECT_EQ(listener_.opened, before) << "no callback from within the call";
    ASSERT_TRUE(test::RunUntil(io_, [&] { return listener_.opened > before; })) << Failure();
    EXPECT_TRUE(port_->is_open());
  }
  std::string Failure() const {
    return listener_.failures.empty() ? "no answer to Open" : listener_.failures.back();
  }
  bool WaitForReceived(std::size_t count) {
    return test::RunUntil(io_, [&] { return listener_.received.size() >= count; });
  }
  bool WaitForFailure() {
    return test::RunUntil(io_, [&] { return !listener_.failures.empty(); });
  }

  asio::io_context io_;
  bool stalled_ = false;
  fs::path folder_;
  std::string link_;
  config::SerialSettings serial_;
  test::Recorder listener_;
  std::optional<tools::Pty> pty_;
  std::optional<Far> far_;
  std::unique_ptr<Transport> port_;
};

}  // namespace baudgate::transports
