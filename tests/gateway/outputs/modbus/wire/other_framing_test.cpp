// A client that speaks another framing than its listener is recognised by its first bytes.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "protocols/modbus/protocol.h"

namespace baudgate::modbus {
namespace {

const Frames& Both() {
  static const Frames kFrames{&ModbusRtuProtocol(), &ModbusAsciiProtocol()};
  return kFrames;
}

/// Reads register 0 of unit 1.
Bytes RequestIn(Framing framing) {
  const Bytes pdu = {3, 0, 0, 0, 1};
  if (framing == Framing::tcp) return AduOf(1, 1, pdu);
  return Both().Of(framing)->carrier->wrap(1, pdu);
}

TEST(OtherFraming, TellsEachFromTheOthers) {
  constexpr Framing kAll[] = {Framing::tcp, Framing::rtu, Framing::ascii};
  for (const Framing expected : kAll) {
    for (const Framing spoken : kAll) {
      const auto other = OtherFraming(RequestIn(spoken), expected, Both());
      EXPECT_EQ(other, spoken == expected ? std::nullopt : std::optional(spoken))
          << Title(spoken) << " where " << Title(expected) << " is expected";
    }
  }
}

TEST(OtherFraming, WaitsForAWholeRequest) {
  for (const Framing spoken : {Framing::rtu, Framing::ascii}) {
    const Bytes request = RequestIn(spoken);
    // The CR is enough: its LF comes with it.
    const std::size_t whole = request.size() - (spoken == Framing::ascii ? 1 : 0);
    for (std::size_t count = 0; count < whole; ++count) {
      EXPECT_FALSE(OtherFraming(View(request).first(count), Framing::tcp, Both()))
          << Title(spoken) << ", " << count << " bytes";
    }
  }
  const Bytes request = RequestIn(Framing::tcp);
  for (std::size_t count = 0; count < request.size(); ++count) {
    EXPECT_FALSE(OtherFraming(View(request).first(count), Framing::rtu, Both())) << count;
  }
}

TEST(OtherFraming, SaysNothingOfNoise) {
  Bytes noise(kMostLookedAt);
  std::uint32_t random = 1;
  for (std::uint8_t& byte : noise) {
    random = random * 1'664'525U + 1'013'904'223U;
    byte = static_cast<std::uint8_t>(random >> 24U);
  }
  EXPECT_FALSE(OtherFraming(noise, Framing::tcp, {}));
  EXPECT_FALSE(OtherFraming(ToBytes("GET / HTTP/1.1\r\n\r\n"), Framing::tcp, Both()));
}

/// The register count of an RTU request stands where Modbus TCP has its length.
TEST(OtherFraming, ADamagedRequestIsNotAnotherFraming) {
  for (std::uint8_t count = 1; count < 125; ++count) {
    Bytes request = Both().rtu->carrier->wrap(1, Bytes{3, 0, 0, 0, count});
    request.back() ^= 1;
    EXPECT_FALSE(OtherFraming(request, Framing::rtu, Both())) << int{count};
  }
}

TEST(OtherFraming, SaysWhatToDo) {
  EXPECT_EQ(ExplainOther(Framing::ascii, Framing::tcp),
            "it speaks Modbus ASCII, and Modbus TCP is spoken here; set framing: ascii at the "
            "listener, or change the other side");
}

}  // namespace
}  // namespace baudgate::modbus
