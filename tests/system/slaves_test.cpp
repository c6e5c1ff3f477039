// Tests independent slaves with independent masters (libmodbus, pymodbus, mbpoll) through routes.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <modbus/modbus.h>

#include <array>
#include <numeric>

#include "tests/system/libmodbus_slave.h"
#include "tests/system/null_modem.h"
#include "tests/system/route_station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

constexpr std::uint16_t kNotFitted = 0x0504;

std::vector<std::uint16_t> Counting(std::size_t count, int first) {
  std::vector<std::uint16_t> values(count);
  std::iota(values.begin(), values.end(), static_cast<std::uint16_t>(first));
  return values;
}

struct FreeContext {
  void operator()(modbus_t* context) const {
    modbus_close(context);
    modbus_free(context);
  }
};
using Context = std::unique_ptr<modbus_t, FreeContext>;

class Slaves : public RouteStation {
 protected:
  Context Connect(int unit) const {
    Context context(modbus_new_tcp("127.0.0.1", port()));
    modbus_set_response_timeout(context.get(), 10, 0);
    modbus_set_slave(context.get(), unit);
    EXPECT_EQ(modbus_connect(context.get()), 0) << modbus_strerror(errno);
    return context;
  }
};

TEST_F(Slaves, ALibmodbusMasterReadsALibmodbusSlave) {
  const NullModem cable(LinkOf("drive"), FarEnd("drive"));
  const auto slave = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  ASSERT_TRUE(cable.connected() && slave->connected());
  const auto daemon = StartGateway(Yaml({"{ units: 20, line: drive }"}, BareLine("drive")));
  const Context master = Connect(kUnit);
  std::vector<std::uint8_t> bits(2000);
  EXPECT_EQ(modbus_read_bits(master.get(), 1, 37, bits.data()), 37);
  EXPECT_EQ(bits[2], 1) << "coil 3";
  EXPECT_EQ(bits[3], 0) << "coil 4";
  EXPECT_EQ(modbus_read_input_bits(master.get(), 0, 1000, bits.data()), 1000);
  EXPECT_EQ(bits[995], 1);
  EXPECT_EQ(bits[999], 0);
  for (const int count : {1, 2, 120, 125}) {
    std::vector<std::uint16_t> registers(static_cast<std::size_t>(count));
    EXPECT_EQ(modbus_read_registers(master.get(), 7, count, registers.data()), count);
    EXPECT_EQ(registers, Counting(registers.size(), 1007));
    EXPECT_EQ(modbus_read_input_registers(master.get(), 7, count, registers.data()), count);
    EXPECT_EQ(registers, Counting(registers.size(), 2007));
  }
}

TEST_F(Slaves, ALibmodbusSlaveAcceptsEveryWriteOfLibmodbus) {
  const NullModem cable(LinkOf("drive"), FarEnd("drive"));
  const auto slave = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  ASSERT_TRUE(cable.connected() && slave->connected());
  const auto daemon = StartGateway(Yaml({"{ units: 20, line: drive }"}, BareLine("drive")));
  const Context master = Connect(kUnit);
  std::vector<std::uint16_t> registers(125);
  EXPECT_EQ(modbus_write_bit(master.get(), 4, TRUE), 1);
  const std::array<std::uint8_t, 10> coils = {0, 1, 1, 0, 0, 1, 0, 0, 1, 1};
  EXPECT_EQ(modbus_write_bits(master.get(), 90, 10, coils.data()), 10);
  std::array<std::uint8_t, 10> read_back{};
  EXPECT_EQ(modbus_read_bits(master.get(), 90, 10, read_back.data()), 10);
  EXPECT_EQ(read_back, coils);
  EXPECT_EQ(modbus_read_bits(master.get(), 4, 1, read_back.data()), 1);
  EXPECT_EQ(read_back[0], 1);

  EXPECT_EQ(modbus_write_register(master.get(), 13, 2500), 1);
  EXPECT_EQ(modbus_read_registers(master.get(), 13, 1, registers.data()), 1);
  EXPECT_EQ(registers[0], 2500);
  const std::vector<std::uint16_t> block = Counting(120, 40000);
  EXPECT_EQ(modbus_write_registers(master.get(), 100, 120, block.data()), 120);
  EXPECT_EQ(modbus_read_registers(master.get(), 100, 125, registers.data()), 125);
  EXPECT_EQ(std::vector(registers.begin(), registers.begin() + 120), block);
  EXPECT_EQ(registers[120], 1220) << "beyond the block";

  EXPECT_EQ(modbus_write_register(master.get(), 50, 0x1234), 1);
  EXPECT_EQ(modbus_mask_write_register(master.get(), 50, 0xFF0F, 0x00A0), 1);
  EXPECT_EQ(modbus_read_registers(master.get(), 50, 1, registers.data()), 1);
  EXPECT_EQ(registers[0], 0x12A4);
  const std::vector<std::uint16_t> written = {7, 8, 9};
  EXPECT_EQ(
      modbus_write_and_read_registers(master.get(), 60, 3, written.data(), 59, 5, registers.data()),
      5);
  EXPECT_EQ(std::vector(registers.begin(), registers.begin() + 5),
            (std::vector<std::uint16_t>{1059, 7, 8, 9, 1063}));
}

class PymodbusSlave : public Slaves, public testing::WithParamInterface<const char*> {
 protected:
  std::string protocol() const { return std::string("modbus_") + GetParam(); }
};

TEST_P(PymodbusSlave, AnswersEveryFunctionOfPymodbus) {
  const NullModem cable(LinkOf("meters"), FarEnd("meters"));
  const auto slave = StartPymodbusSlave(GetParam(), FarEnd("meters"), "20");
  const auto daemon = StartGateway(
      Yaml({"{ units: 33, line: meters, remap: 20 }"}, BareLine("meters", {}, protocol())),
      {"meters"});
  const Json results =
      Pymodbus("tcp", std::to_string(port()), 33,
               {"coils:0:7", "discrete:0:11", "holding:10:3", "input:0:2", "coil:1:1",
                "write_coils:3:0:1", "coils:0:7", "register:10:77", "write_registers:11:78:79",
                "holding:10:3", "mask:10:65295:160", "read_write:9:4:11:5:6", "loopback:42330",
                "identity", "holding:999:2"});
  ASSERT_EQ(results.size(), 15U) << results;
  EXPECT_EQ(results[0], Json({1, 0, 0, 1, 0, 0, 1}));
  EXPECT_EQ(results[1], Json({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
  EXPECT_EQ(results[2], Json({2010, 2011, 2012}));
  EXPECT_EQ(results[3], Json({12000, 12001}));
  EXPECT_EQ(results[4], true);
  EXPECT_EQ(results[5], true);
  EXPECT_EQ(results[6], Json({1, 1, 0, 0, 1, 0, 1}));
  EXPECT_EQ(results[7], true);
  EXPECT_EQ(results[8], true);
  EXPECT_EQ(results[9], Json({77, 78, 79}));
  EXPECT_EQ(results[10], true);
  EXPECT_EQ(results[11], Json({2009, 0xAD, 5, 6})) << "77 masked: (0x4D & 0xFF0F) | 0xA0";
  EXPECT_EQ(results[12], Json({42330})) << "function 08";
  EXPECT_EQ(results[13], Json({{"0", "Acme"}, {"1", "M-7"}, {"2", "2.5"}})) << "function 43/14";
  EXPECT_EQ(results[14], Json({{"exception", kIllegalAddress}})) << "the slave's own";
}

TEST_P(PymodbusSlave, IsServedFromTheStoreBesideARoutedSlave) {
  const NullModem cable(LinkOf("meters"), FarEnd("meters"));
  const auto slave = StartPymodbusSlave(GetParam(), FarEnd("meters"), "20,21");
  const auto daemon = StartGateway(
      Yaml({"{ units: 20, line: meters }"},
           "  - name: meters\n    port: " + LinkOf("meters") + "\n    protocol: " + protocol() +
               "\n    devices:\n"
               "      - name: cached\n        address: 21\n        unit: 30\n        poll: 50ms\n  "
               "      write: allow\n"
               "        points:\n"
               "          - { name: a, read: \"holding 4\", type: uint16, access: rw, modbus: 0 }\n"
               "          - { name: b, read: \"input 300\", type: uint16, modbus: 1 }\n"
               "          - { name: c, read: \"coil 3\", type: bool, modbus: 0 }\n"),
      {"meters"});
  ModbusClient client(port());
  ASSERT_TRUE(EventuallyQuality(client, 30, 0, kGood));
  ASSERT_TRUE(EventuallyQuality(client, 30, 1, kGood));
  for (int i = 0; i < 20; ++i) {
    const Registers routed = client.Holding(kUnit, i, 3);
    ASSERT_TRUE(routed.ok()) << routed.exception;
    EXPECT_EQ(routed.values, Counting(3, 2000 + i));
    EXPECT_EQ(client.Input(30, 0, 2).values, (std::vector<std::uint16_t>{2104, 12400}));
  }
  EXPECT_EQ(client.DiscreteInputs(30, 0, 1).values, Bits{{1}}.values);
  EXPECT_EQ(client.WriteRegister(30, 0, 555), kNoException);
  EXPECT_TRUE(Eventually([&] { return client.Register(30, 0) == 555; }));
  EXPECT_EQ(client.WriteRegister(kUnit, 4, 556), kNoException);
  EXPECT_EQ(client.Holding(kUnit, 4, 1).values, std::vector<std::uint16_t>{556});
  EXPECT_EQ(client.Register(30, 0), 555) << "the other slave's register";
  EXPECT_EQ(client.Register(30, 20000), kGood);
}

TEST_P(PymodbusSlave, ReportsItsIdentity) {
  const NullModem cable(LinkOf("meters"), FarEnd("meters"));
  const auto slave = StartPymodbusSlave(GetParam(), FarEnd("meters"), "21");
  const auto daemon = StartGateway(
      Yaml({},
           "  - name: meters\n    port: " + LinkOf("meters") + "\n    protocol: " + protocol() +
               "\n    devices:\n      - name: meter\n        address: 21\n        unit: 30\n"
               "        poll: 100ms\n        identity: [\"m 7\", M-7]\n        points:\n"
               "          - { name: type, read: identification product, type: string(4), "
               "group: once, modbus: 10 }\n"
               "          - { name: id, read: server id, type: string(12), group: once, "
               "modbus: 20 }\n"
               "          - { name: low, read: \"holding 5[b0-b7]\", type: uint16, modbus: 0 }\n"),
      {"meters"});
  ModbusClient client(port());
  for (const int address : {0, 10, 20}) {
    EXPECT_TRUE(EventuallyQuality(client, 30, address, kGood)) << address;
  }
  EXPECT_EQ(client.Input(30, 10, 2).values, (std::vector<std::uint16_t>{0x4D2D, 0x3700})) << "M-7";
  EXPECT_EQ(client.Input(30, 20, 6).values,
            (std::vector<std::uint16_t>{0x4163, 0x6D65, 0x2D4D, 0x2D37, 0x2D32, 0x2E35}))
      << "Acme-M-7-2.5";
  EXPECT_EQ(client.Register(30, 0), 2105 & 0xFF);
}

TEST_P(PymodbusSlave, WithHolesIsReadInParts) {
  const NullModem cable(LinkOf("meters"), FarEnd("meters"));
  const auto slave = StartPymodbusSlave(GetParam(), FarEnd("meters"), "21", {"0-5", "9-12"});
  std::string points;
  for (const int address : {0, 5, 7, 9, 12}) {
    points += "          - { name: r" + std::to_string(address) + ", read: \"holding " +
              std::to_string(address) + "\", type: uint16, modbus: " + std::to_string(address) +
              " }\n";
  }
  const auto daemon = StartGateway(
      Yaml({}, "  - name: meters\n    port: " + LinkOf("meters") + "\n    protocol: " + protocol() +
                   "\n    devices:\n      - name: holey\n        address: 21\n        unit: 30\n"
                   "        poll: 100ms\n        points:\n" +
                   points),
      {"meters"});
  ModbusClient client(port());
  for (const int address : {0, 5, 9, 12}) {
    EXPECT_TRUE(EventuallyQuality(client, 30, address, kGood)) << address;
    EXPECT_EQ(client.Register(30, address), 2100 + address);
  }
  EXPECT_TRUE(EventuallyQuality(client, 30, 7, kNotFitted)) << "there is no register 7";
  for (const int address : {0, 5, 9, 12}) {
    EXPECT_EQ(client.Register(30, address + 20000), kGood) << address;
  }
}

INSTANTIATE_TEST_SUITE_P(OfEachFraming, PymodbusSlave, testing::Values("rtu", "ascii"),
                         [](const auto& info) { return std::string(info.param); });

TEST_F(Slaves, SlavesOfSeveralLinesAnswerMbpoll) {
  const NullModem cable(LinkOf("drive"), FarEnd("drive"));
  const NullModem other(LinkOf("meters"), FarEnd("meters"));
  const auto drive = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  const auto meters = StartPymodbusSlave("rtu", FarEnd("meters"), "1,2");
  const auto daemon =
      StartGateway(Yaml({"{ units: 20, line: drive }", "{ units: 33-40, line: meters, remap: 1 }"},
                        BareLine("drive") + BareLine("meters")),
                   {"drive", "meters"});
  const Finished three = MbpollTcp("20,33,34", {"-r", "800", "-c", "125"});
  EXPECT_EQ(three.code, 0) << three.errors;
  EXPECT_THAT(three.output, HasSubstr(MbpollLine(924, 1924)));
  EXPECT_THAT(three.output, HasSubstr(MbpollLine(924, 1024))) << "slave 1: 100 + 924";
  EXPECT_THAT(three.output, HasSubstr(MbpollLine(924, 1124))) << "slave 2";
  EXPECT_EQ(MbpollTcp("20", {"-r", "5"}, {"4711"}).code, 0) << "function 06";
  EXPECT_EQ(MbpollTcp("34", {"-r", "6"}, {"1", "2", "3"}).code, 0) << "function 16";
  EXPECT_EQ(MbpollTcp("20", {"-r", "1", "-t", "0"}, {"1"}).code, 0) << "function 05";
  EXPECT_EQ(MbpollTcp("34", {"-r", "1", "-t", "0"}, {"1", "1"}).code, 0) << "function 15";
  EXPECT_THAT(MbpollTcp("20", {"-r", "5"}).output, HasSubstr(MbpollLine(5, 4711)));
  EXPECT_THAT(MbpollTcp("34", {"-r", "5", "-c", "4"}).output,
              HasSubstr(MbpollLine(5, 205) + "\n" + MbpollLine(6, 1) + "\n" + MbpollLine(7, 2) +
                        "\n" + MbpollLine(8, 3)));
  EXPECT_THAT(MbpollTcp("34", {"-r", "1", "-t", "0", "-c", "2"}).output,
              HasSubstr(MbpollLine(1, 1) + "\n" + MbpollLine(2, 1)));
  const Finished silent = MbpollTcp("35", {"-r", "0", "-o", "5"});
  EXPECT_EQ(silent.code, 1) << "there is no slave 3";
  EXPECT_THAT(silent.errors, HasSubstr("Target device failed to respond"));
}

TEST_F(Slaves, TheInverterTwinAnswersAtItsBitRate) {
  const auto twin = Start({"simulate", "--profile", "mitsubishi-fr-d700", "--address", "20",
                           "--pty", LinkOf("drive"), "--baud", "19200 8E1"});
  const auto daemon =
      StartGateway(Yaml({"{ units: 20, line: drive }"}, BareLine("drive", "serial: 19200 8E1")));
  ModbusClient client(port());
  EXPECT_EQ(client.Holding(kUnit, 500, 1).values[0], 0) << "no fault";
  EXPECT_EQ(client.WriteRegister(kUnit, 13, 2500), kNoException);
  EXPECT_EQ(client.Holding(kUnit, 13, 1).values[0], 2500);
  EXPECT_EQ(client.WriteRegister(kUnit, 8, 2), kNoException) << "forward";
  const Registers block = client.Holding(kUnit, 999, 120);
  ASSERT_TRUE(block.ok()) << block.exception;
  EXPECT_EQ(block.values[0], 60) << "Pr.0";
  EXPECT_EQ(block.values[117], 20) << "Pr.117";
  EXPECT_EQ(block.values[119], 0) << "missing registers read 0";
  EXPECT_EQ(client.Holding(kUnit, 5000, 2).exception, kIllegalAddress) << "all are missing";
  EXPECT_EQ(client.WriteRegisters(kUnit, 999, block.values), kNoException);
}

}  // namespace
}  // namespace baudgate::system_test
