// The server seen by an independent client: libmodbus.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <modbus.h>

#include <array>
#include <cerrno>
#include <memory>

#include "tests/gateway/outputs/modbus/server/server_fixture.h"

namespace baudgate::modbus {
namespace {

class LibmodbusTest : public ServerTest {
 protected:
  struct Free {
    void operator()(modbus_t* context) const {
      modbus_close(context);
      modbus_free(context);
    }
  };

  void ConnectLibmodbus() {
    context_.reset(modbus_new_tcp("127.0.0.1", server_->port()));
    ASSERT_NE(context_, nullptr);
    modbus_set_slave(context_.get(), 1);
    modbus_set_response_timeout(context_.get(), 20, 0);
    ASSERT_EQ(modbus_connect(context_.get()), 0);
  }

  std::unique_ptr<modbus_t, Free> context_;
};

TEST_F(LibmodbusTest, ReadsValues) {
  StartServer();
  ConnectLibmodbus();
  std::array<std::uint16_t, 3> registers{};
  ASSERT_EQ(modbus_read_registers(context_.get(), 0, 3, registers.data()), 3);
  EXPECT_EQ(registers[0], 0xFFFE);
  EXPECT_EQ(modbus_get_float_abcd(&registers[1]), 123456.0F);
  ASSERT_EQ(modbus_read_input_registers(context_.get(), 0, 3, registers.data()), 3);
  EXPECT_EQ(modbus_get_float_abcd(&registers[1]), 123456.0F);
  std::array<std::uint8_t, 2> bits{};
  ASSERT_EQ(modbus_read_bits(context_.get(), 0, 2, bits.data()), 2);
  EXPECT_EQ(bits, (std::array<std::uint8_t, 2>{1, 0}));
  ASSERT_EQ(modbus_read_input_bits(context_.get(), 20000, 2, bits.data()), 2);
  EXPECT_EQ(bits, (std::array<std::uint8_t, 2>{1, 1}));
}

TEST_F(LibmodbusTest, ReadsTheLargestBlocks) {
  std::vector<config::Point> points;
  for (std::uint16_t i = 0; i < 125; ++i) points.push_back(MakePoint(Type::int16, i));
  for (std::uint16_t i = 0; i < 2000; ++i) points.push_back(MakePoint(Type::boolean, i));
  config_.lines[0].devices.push_back(MakeDevice(2, points));
  StartServer();
  std::vector<Sample> samples;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    samples.push_back({i, std::int64_t{i < 125 ? i : i % 3}, Quality::good});
  }
  const Now later{ReadClocks().instant + 1h, {}};
  store_->Update(1, samples, later, 1ms);
  ConnectLibmodbus();
  modbus_set_slave(context_.get(), 2);
  std::vector<std::uint16_t> registers(125);
  ASSERT_EQ(modbus_read_registers(context_.get(), 0, 125, registers.data()), 125);
  for (std::uint16_t i = 0; i < 125; ++i) ASSERT_EQ(registers[i], i);
  std::vector<std::uint8_t> bits(2000);
  ASSERT_EQ(modbus_read_bits(context_.get(), 0, 2000, bits.data()), 2000);
  for (std::size_t i = 0; i < 2000; ++i) ASSERT_EQ(bits[i], (i + 125) % 3 == 0 ? 0 : 1) << i;
}

TEST_F(LibmodbusTest, SeesExceptions) {
  StartServer();
  ConnectLibmodbus();
  std::uint16_t value = 0;
  EXPECT_EQ(modbus_read_registers(context_.get(), 4, 1, &value), -1);
  EXPECT_EQ(errno, EMBXILADD);
  EXPECT_EQ(modbus_read_registers(context_.get(), 1, 1, &value), -1);
  EXPECT_EQ(errno, EMBXILVAL);
  EXPECT_EQ(modbus_read_registers(context_.get(), 3, 1, &value), -1);
  EXPECT_EQ(errno, EMBXGTAR);
  modbus_set_slave(context_.get(), 77);
  EXPECT_EQ(modbus_read_registers(context_.get(), 0, 1, &value), -1);
  EXPECT_EQ(errno, EMBXGPATH);
}

TEST_F(LibmodbusTest, Writes) {
  sink_.answer = WriteEnd::ok;
  StartServer();
  ConnectLibmodbus();
  EXPECT_EQ(modbus_write_register(context_.get(), 0, 0xFFFD), 1);
  EXPECT_EQ(sink_.Wait(0).writes()[0].raw, Value(std::int64_t{-3}));
  const std::array<std::uint16_t, 3> registers = {1, 0x3F80, 0};
  EXPECT_EQ(modbus_write_registers(context_.get(), 0, 3, registers.data()), 3);
  EXPECT_EQ(sink_.Wait(1).writes()[1].raw, Value(1.0));
  EXPECT_EQ(modbus_write_bit(context_.get(), 0, 1), 1);
  EXPECT_EQ(sink_.Wait(2).writes()[0].raw, Value(true));
  const std::uint8_t off = 0;
  EXPECT_EQ(modbus_write_bits(context_.get(), 0, 1, &off), 1);
  EXPECT_EQ(sink_.Wait(3).writes()[0].raw, Value(false));
}

}  // namespace
}  // namespace baudgate::modbus
