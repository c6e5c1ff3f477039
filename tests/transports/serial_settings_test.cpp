// Tests settings on real ptys, and the comparison with what a driver reads back.
// SPDX-License-Identifier: Apache-2.0
#include "transports/serial_settings.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>

#include "gateway/tools/simulate/pty.h"
#include "tests/transports/far_end.h"
#include "transports/parity.h"

namespace baudgate::transports {
namespace {

config::SerialSettings Settings(int baud, int data_bits, config::Parity parity, int stop_bits) {
  config::SerialSettings serial;
  serial.baud = baud;
  serial.data_bits = data_bits;
  serial.parity = parity;
  serial.stop_bits = stop_bits;
  return serial;
}

const config::SerialSettings k7E1 = Settings(9600, 7, config::Parity::even, 1);
const config::SerialSettings k8N1 = Settings(9600, 8, config::Parity::none, 1);

class PtySlave {
 public:
  explicit PtySlave(const tools::Pty& pty)
      : fd(open(pty.slave_path().c_str(), O_RDWR | O_NOCTTY)) {}
  ~PtySlave() { close(fd); }
  const int fd;
};

class SerialSettingsOnPty : public testing::Test {
 protected:
  Result<tools::Pty> pty_ = tools::Pty::Create();
};

TEST_F(SerialSettingsOnPty, TheSameSettingsApplyAgainAfterReopen) {
  // The second call would fail if it used the C library's tcsetattr.
  for (int round = 0; round < 3; ++round) {
    const PtySlave slave(*pty_);
    const Status set = ApplySerialSettings(slave.fd, k7E1, "pty");
    EXPECT_TRUE(set.ok()) << set.error();
    EXPECT_TRUE(ApplySerialSettings(slave.fd, k7E1, "pty").ok());
  }
}

TEST_F(SerialSettingsOnPty, ATerminalBecomesRaw) {
  const PtySlave slave(*pty_);
  termios terminal{};
  terminal.c_iflag = ICRNL | IXON | ISTRIP | BRKINT;
  terminal.c_oflag = OPOST | ONLCR;
  terminal.c_lflag = ICANON | ECHO | ISIG;
  terminal.c_cflag = CS8 | CREAD;
  ASSERT_EQ(tcsetattr(slave.fd, TCSANOW, &terminal), 0);
  ASSERT_TRUE(ApplySerialSettings(slave.fd, k8N1, "pty").ok());

  const std::string bytes("\r\n\x03\x11\x13\x04\x80", 7);
  char got[16];
  ASSERT_EQ(write(pty_->master(), bytes.data(), bytes.size()), 7);
  ASSERT_EQ(read(slave.fd, got, sizeof got), 7);
  EXPECT_EQ(std::string(got, 7), bytes);
  ASSERT_EQ(write(slave.fd, bytes.data(), bytes.size()), 7);
  ASSERT_EQ(read(pty_->master(), got, sizeof got), 7) << "no echo, nothing translated";
  EXPECT_EQ(std::string(got, 7), bytes);
}

TEST_F(SerialSettingsOnPty, AnyBitRateCanBeSet) {
  const PtySlave slave(*pty_);
  for (const int baud : {300, 9600, 10400, 250000, 921600}) {
    ASSERT_TRUE(
        ApplySerialSettings(slave.fd, Settings(baud, 8, config::Parity::none, 2), "pty").ok());
    const auto actual = ReadSerialSettings(slave.fd);
    ASSERT_TRUE(actual.ok());
    EXPECT_EQ(actual->baud, baud);
    EXPECT_EQ(actual->stop_bits, 2);
  }
}

TEST_F(SerialSettingsOnPty, InvalidSettingsAreRefused) {
  const PtySlave slave(*pty_);
  using config::Parity;
  for (const auto& serial :
       {Settings(299, 8, Parity::none, 1), Settings(921601, 8, Parity::none, 1),
        Settings(9600, 4, Parity::none, 1), Settings(9600, 8, Parity::none, 3)}) {
    EXPECT_FALSE(ApplySerialSettings(slave.fd, serial, "pty").ok()) << serial.ToString();
  }
}

TEST_F(SerialSettingsOnPty, Rs485WithoutDriverSupportReportsWhatToDo) {
  const PtySlave slave(*pty_);
  config::SerialSettings serial = k8N1;
  serial.rs485.enabled = true;
  const Status set = ApplySerialSettings(slave.fd, serial, "/dev/ttyX");
  ASSERT_FALSE(set.ok());
  EXPECT_NE(set.error().find("/dev/ttyX has no RS-485 mode"), std::string::npos) << set.error();
  EXPECT_NE(set.error().find("remove `rs485:`"), std::string::npos);
}

TEST_F(SerialSettingsOnPty, APtyIsRecognised) {
  const PtySlave slave(*pty_);
  EXPECT_TRUE(IsPty(slave.fd));
  const int null = open("/dev/null", O_RDWR);
  EXPECT_FALSE(IsPty(null));
  const Status set = ApplySerialSettings(null, k8N1, "/dev/null");
  close(null);
  ASSERT_FALSE(set.ok());
  EXPECT_NE(set.error().find("/dev/null is not a serial port"), std::string::npos);
}

TEST_F(SerialSettingsOnPty, APtyHasNoDriverCounters) {
  const PtySlave slave(*pty_);
  EXPECT_FALSE(ReadDriverCounters(slave.fd).has_value());
}

TEST(CompareSettings, RoundingOfTheDividerIsAccepted) {
  EXPECT_TRUE(CompareSettings(Settings(921600, 8, config::Parity::none, 1),
                              Settings(923077, 8, config::Parity::none, 1), "p")
                  .ok());
}

/// Linux requires of a driver that its answer contains no setting that the driver does not support.
TEST(CompareRs485, EachKeyThatTheDriverDoesNotKeepIsNamed) {
  config::Rs485 asked;
  asked.enabled = true;
  asked.delay_before_send = 1500us;  // the driver gets 2ms
  EXPECT_TRUE(CompareRs485(asked, asked, "/dev/ttyS2"));
  config::Rs485 actual = asked;
  actual.delay_before_send = 2ms;
  EXPECT_TRUE(CompareRs485(asked, actual, "/dev/ttyS2"));
  actual.delay_before_send = {};
  actual.rts_active_high = false;
  EXPECT_EQ(CompareRs485(asked, actual, "/dev/ttyS2").error(),
            "the driver of /dev/ttyS2 does not support these `rs485:` settings: with them "
            "rts_active_high is false, delay_before_send is 0ms; write values that the driver "
            "supports, or use an adapter that switches direction by itself");
}

TEST(CompareSettings, EveryOtherDifferenceIsAnErrorWithAHint) {
  using config::Parity;
  const auto error = [](const config::SerialSettings& asked, const config::SerialSettings& actual) {
    const Status same = CompareSettings(asked, actual, "/dev/ttyUSB1");
    return same.ok() ? std::string("none") : same.error();
  };
  EXPECT_EQ(error(k7E1, k8N1),
            "the driver of /dev/ttyUSB1 did not set 9600 7E1 but 9600 8N1; "
            "set `parity: software`");
  EXPECT_EQ(error(Settings(9600, 8, Parity::even, 1), k8N1),
            "the driver of /dev/ttyUSB1 did not set 9600 8E1 but 9600 8N1; set serial to a format "
            "that this port supports");
  EXPECT_NE(error(Settings(10400, 8, Parity::none, 1), k8N1).find("bit rate"), std::string::npos);
  EXPECT_NE(error(Settings(9600, 8, Parity::none, 2), k8N1).find("stop bits"), std::string::npos);
  EXPECT_NE(error(k7E1, Settings(9600, 7, Parity::odd, 1)).find("7O1"), std::string::npos);
  config::SerialSettings flow = k8N1;
  flow.rtscts = true;
  EXPECT_NE(error(flow, k8N1).find("RTS/CTS"), std::string::npos);
  EXPECT_EQ(error(k8N1, k8N1), "none");
}

TEST(SameSettings, EveryFieldCounts) {
  EXPECT_TRUE(SameSettings(k8N1, k8N1));
  EXPECT_FALSE(SameSettings(k8N1, k7E1));
  config::SerialSettings other = k8N1;
  other.software_parity = true;
  EXPECT_FALSE(SameSettings(k8N1, other));
  other = k8N1;
  other.rs485.delay_after_send = 1ms;
  EXPECT_FALSE(SameSettings(k8N1, other));
}

using config::Parity;

TEST(SoftwareParity, KnownCharactersHaveTheirParityBit) {
  EXPECT_EQ(WithParity('A', Parity::even), 0x41);
  EXPECT_EQ(WithParity('A', Parity::odd), 0xC1);
  EXPECT_EQ(WithParity('>', Parity::even), 0xBE);
  EXPECT_EQ(WithParity('>', Parity::odd), 0x3E);
  EXPECT_EQ(WithParity(0x00, Parity::odd), 0x80);
}

TEST(SoftwareParity, EveryCharacterSurvivesARoundTrip) {
  for (const Parity parity : {Parity::even, Parity::odd}) {
    for (int value = 0; value < 128; ++value) {
      const auto character = static_cast<std::uint8_t>(value);
      EXPECT_EQ(WithoutParity(WithParity(character, parity), parity), character);
    }
  }
}

TEST(SoftwareParity, EverySingleBitErrorIsDetected) {
  for (const Parity parity : {Parity::even, Parity::odd}) {
    for (int value = 0; value < 128; ++value) {
      for (int bit = 0; bit < 8; ++bit) {
        const auto damaged = static_cast<std::uint8_t>(
            WithParity(static_cast<std::uint8_t>(value), parity) ^ (1U << bit));
        EXPECT_EQ(WithoutParity(damaged, parity), std::nullopt) << value << " bit " << bit;
      }
    }
  }
}

TEST(SoftwareParity, EighthBitOfTheSenderIsNotSent) {
  EXPECT_EQ(WithParity(0xC1, Parity::even), WithParity(0x41, Parity::even));
}

TEST(SoftwareParity, DamageIsMarkedAndCounted) {
  SoftwareParity parity(Parity::even);
  Bytes wire = parity.Encode(ToBytes(">+12.3\r"));
  wire[3] ^= 0x80;
  Bytes expected = ToBytes(">+12.3\r");
  expected[3] = kDamaged;
  EXPECT_EQ(parity.Decode(wire), expected);
  EXPECT_EQ(parity.errors(), 1U);
}

TEST(SoftwareParity, ParityNoneChangesNothing) {
  SoftwareParity parity;
  const Bytes bytes = {0x00, 0x7F, 0x80, 0xFF};
  EXPECT_EQ(parity.Encode(bytes), bytes);
  EXPECT_EQ(parity.Decode(bytes), bytes);
  EXPECT_EQ(parity.errors(), 0U);
}

TEST(SoftwareParity, PortIsSetToEightNone) {
  config::SerialSettings serial;
  serial.data_bits = 7;
  serial.parity = Parity::even;
  EXPECT_EQ(OnTheWire(serial).ToString(), "9600 7E1");
  serial.software_parity = true;
  EXPECT_EQ(OnTheWire(serial).ToString(), "9600 8N1");
  EXPECT_EQ(OnTheWire(serial).BitsPerCharacter(), serial.BitsPerCharacter());
}

TEST(SoftwareParity, NeedsSevenBitsAndAParity) {
  config::SerialSettings serial;
  EXPECT_TRUE(CheckSoftwareParity(serial).ok());
  serial.software_parity = true;
  EXPECT_FALSE(CheckSoftwareParity(serial).ok());
  serial.data_bits = 7;
  EXPECT_FALSE(CheckSoftwareParity(serial).ok());
  serial.parity = Parity::odd;
  EXPECT_TRUE(CheckSoftwareParity(serial).ok());
}

Bytes AsTheKernelWrites(View characters) {
  Bytes marked;
  for (const std::uint8_t character : characters) {
    marked.push_back(character);
    if (character == 0xFF) marked.push_back(0xFF);
  }
  return marked;
}

TEST(ParmrkDecoder, EveryUndamagedByteIsDecoded) {
  ParmrkDecoder decoder;
  EXPECT_EQ(decoder.Decode(AsTheKernelWrites(test::AllBytes())), test::AllBytes());
  EXPECT_EQ(decoder.damaged(), 0U);
}

TEST(ParmrkDecoder, DamagedCharacterKeepsItsPlace) {
  ParmrkDecoder decoder;
  const Bytes marked = {'>', '+', '1', 0xFF, 0x00, '2', '.', '3', '\r'};
  const Bytes expected = {'>', '+', '1', kDamaged, '.', '3', '\r'};
  EXPECT_EQ(decoder.Decode(marked), expected);
  EXPECT_EQ(decoder.damaged(), 1U);
}

TEST(ParmrkDecoder, BreakIsDamage) {
  ParmrkDecoder decoder;
  EXPECT_EQ(decoder.Decode(Bytes{0xFF, 0x00, 0x00, 'A'}), (Bytes{kDamaged, 'A'}));
  EXPECT_EQ(decoder.damaged(), 1U);
}

TEST(ParmrkDecoder, DamagedFfIsNotAnotherEscape) {
  ParmrkDecoder decoder;
  EXPECT_EQ(decoder.Decode(Bytes{0xFF, 0x00, 0xFF, 0x00, 'A'}), (Bytes{kDamaged, 0x00, 'A'}));
  EXPECT_EQ(decoder.damaged(), 1U);
}

TEST(ParmrkDecoder, AnUnknownMarkIsDamage) {
  ParmrkDecoder decoder;
  EXPECT_EQ(decoder.Decode(Bytes{0xFF, 0x41, 'B'}), (Bytes{kDamaged, 'B'}));
  EXPECT_EQ(decoder.damaged(), 1U);
}

TEST(ParmrkDecoder, AnyFragmentationGivesTheSameCharacters) {
  const Bytes marked = {'a', 0xFF, 0xFF, 0xFF, 0x00, 0x33, 0x00, 0xFF, 0x00, 0x00, 0xFF, 0xFF};
  const Bytes expected = {'a', 0xFF, kDamaged, 0x00, kDamaged, 0xFF};
  test::EachFragmentation(marked, [&](const std::vector<Bytes>& pieces) {
    ParmrkDecoder decoder;
    Bytes characters;
    for (const Bytes& piece : pieces) Append(characters, decoder.Decode(piece));
    ASSERT_EQ(characters, expected);
    ASSERT_EQ(decoder.damaged(), 2U);
  });
}

}  // namespace
}  // namespace baudgate::transports
