// A gateway that listens at a pty, and a scripted master at the other end.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdlib.h>

#include <asio/executor_work_guard.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <filesystem>

#include "gateway/outputs/modbus/serial/serial_listener.h"
#include "gateway/tools/simulate/pty.h"
#include "tests/gateway/outputs/modbus/serial/master_fixture.h"
#include "tests/transports/far_end.h"

namespace baudgate::modbus {

class SerialListenerTest : public MasterTest {
 protected:
  using Descriptor = asio::posix::stream_descriptor;

  SerialListenerTest() {
    std::string form = (std::filesystem::temp_directory_path() / "baudgate-master-XXXXXX").string();
    folder_ = mkdtemp(form.data());
    listener().path = (folder_ / "port").string();
  }
  ~SerialListenerTest() override {
    if (serial_) serial_->Stop();
    pty_.reset();
    std::filesystem::remove_all(folder_);
  }

  void PlugIn() {
    auto pty = tools::Pty::Create(listener().path);
    ASSERT_TRUE(pty.ok()) << pty.error();
    pty_.emplace(std::move(*pty));
    master_.emplace(Descriptor(io_, pty_->TakeMaster()));
    master_->Start();
  }
  void Unplug() {
    master_->stream().close();
    pty_->Unplug();
  }
  void Open() {
    MakeShared(ReadClocks());
    shared_->inbox()->Open(io_, ReadClocks);
    serial_ = std::make_shared<SerialListener>(io_, listener(), *shared_);
    serial_->Open();
  }
  bool RunUntilOpen(bool is_open) {
    return test::RunUntil(io_, [&] { return Master().is_open == is_open; });
  }
  void Begin() {
    PlugIn();
    Open();
    ASSERT_TRUE(RunUntilOpen(true));
  }

  void Say(std::uint8_t unit, const std::string& pdu) { master_->Write(Rtu(unit, pdu)); }
  void Expect(std::uint8_t unit, const std::string& pdu) {
    const Bytes frame = Rtu(unit, pdu);
    ASSERT_TRUE(
        test::RunUntil(io_, [&] { return master_->received().size() >= heard_ + frame.size(); }));
    EXPECT_EQ(ToHex(View(master_->received()).subspan(heard_)), ToHex(frame));
    heard_ = master_->received().size();
  }
  void AskForTheValue() {
    Say(1, "03 00 00 00 01");
    Expect(1, "03 02 FF FE");
  }

  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  std::filesystem::path folder_;
  std::optional<tools::Pty> pty_;
  std::optional<test::FarEnd<Descriptor>> master_;
  std::shared_ptr<SerialListener> serial_;
  std::size_t heard_ = 0;
};

}  // namespace baudgate::modbus
