// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/recognise.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::protocols::modbus {
namespace {

/// A frame that begins behind this offset in the received bytes is not looked for.
constexpr std::size_t kFarthest = 300;

/// Size of an exception in bytes: slave, function and code.
constexpr std::size_t kException = 3;
constexpr std::size_t kRtuCheck = 2;
constexpr std::size_t kAsciiCheck = 1;
/// Size of the PDU of a request that reads, or writes one value: function, address, count or value.
constexpr std::size_t kShortRequest = 5;
constexpr std::uint8_t kLastRead = 4;
constexpr std::uint8_t kLastOfOneValue = 6;

constexpr const char* kNoModbus =
    "update the device's firmware, because it does not follow the Modbus standard";

struct Seen {
  Adu adu;
  bool request = false;  ///< true: the frame has the form of a request and not of a reply
};

bool IsWhole(View held, PduLength length) {
  return length.kind == PduLength::Kind::exact && held.size() >= length.size + kRtuOverhead &&
         EndsInCrc16(held.first(length.size + kRtuOverhead));
}

std::optional<Seen> FirstRtu(View heard) {
  for (std::size_t at = 0; at < std::min(heard.size(), kFarthest); ++at) {
    const View held = heard.subspan(at);
    if (held.size() < kRtuOverhead + 1 || held[0] > kLastSlave || held[1] == 0) continue;
    const View pdu = held.subspan(1);
    const PduLength reply = ReplyLength(pdu);
    const bool answers = IsWhole(held, reply);
    const PduLength request = pdu[0] < kExceptionBit ? RequestLength(pdu) : PduLength();
    const bool asks = IsWhole(held, request);
    if (!answers && !asks) continue;
    const std::size_t size = (answers ? reply : request).size;
    return Seen{{held[0], Bytes(pdu.begin(), pdu.begin() + static_cast<std::ptrdiff_t>(size))},
                asks && !answers};
  }
  return std::nullopt;
}

/// True if the bytes begin with a request of a function 1 to 6, or with the reply to a function 1
/// to 4.
bool IsPlainRtu(View held) {
  if (held.size() < kShortRequest + kRtuOverhead || held[0] == 0 || held[0] > kLastSlave)
    return false;
  const std::uint8_t function = held[1];
  if (function == 0 || function > kLastOfOneValue) return false;
  if (EndsInCrc16(held.first(kShortRequest + kRtuOverhead))) return true;
  return function <= kLastRead && IsWhole(held, ReplyLength(held.subspan(1)));
}

std::optional<Seen> FirstAscii(View heard) {
  const auto begin = std::ranges::find(heard, std::uint8_t{':'});
  const auto end = std::find(begin, heard.end(), std::uint8_t{'\r'});
  if (end == heard.end()) return std::nullopt;
  const auto adu = Unwrap(Framing::ascii, View(begin, end + 1));
  if (!adu) return std::nullopt;
  return Seen{*adu, !IsReplyForm(adu->pdu) && IsCommon(adu->pdu)};
}

std::optional<Seen> FirstTcp(View heard) {
  const auto size = TcpSize(heard);
  if (!size || heard.size() < *size) return std::nullopt;
  const auto adu = Unwrap(Framing::tcp, heard.first(*size));
  if (!adu) return std::nullopt;
  return Seen{*adu, false};
}

std::optional<Seen> First(Framing framing, View heard) {
  if (framing == Framing::tcp) return FirstTcp(heard);
  return framing == Framing::rtu ? FirstRtu(heard) : FirstAscii(heard);
}

struct Named {
  Framing framing;
  const char* title;
  const char* protocol;
};
constexpr Named kFramings[] = {{Framing::rtu, "Modbus RTU", "modbus_rtu"},
                               {Framing::ascii, "Modbus ASCII", "modbus_ascii"},
                               {Framing::tcp, "Modbus TCP", "modbus_tcp"}};

std::optional<Recognised> OtherFraming(Framing framing, View heard) {
  for (const Named& other : kFramings) {
    if (other.framing == framing || !First(other.framing, heard)) continue;
    return Recognised{Recognised::What::other_protocol,
                      std::string("messages of ") + other.title + " come back",
                      std::string("set protocol: ") + other.protocol + " in the configuration"};
  }
  return std::nullopt;
}

std::string Slave(std::uint8_t slave) { return "slave " + std::to_string(slave); }

bool IsWholePdu(View pdu) {
  const PduLength length = ReplyLength(pdu);
  return length.kind == PduLength::Kind::exact && length.size == pdu.size();
}

/// Explains a TCP reply whose transaction, protocol number or length is wrong.
std::optional<Recognised> OddHeader(const Adu& asked, View heard) {
  if (heard.size() < kTcpOverhead + 2 || heard.size() > kMaxTcp) return std::nullopt;
  const ByteReader reader(heard);
  const std::uint16_t transaction = *reader.U16Be(0);
  const std::uint16_t protocol = *reader.U16Be(2);
  const std::uint16_t length = *reader.U16Be(4);
  const std::uint8_t function = heard[kTcpOverhead] & ~kExceptionBit;
  if (function != asked.pdu[0]) return std::nullopt;
  const auto odd = [](std::string cause) {
    return Recognised{Recognised::What::other_reply, std::move(cause),
                      "update the firmware of the server"};
  };
  if (protocol != 0) {
    return odd("the header of its replies has protocol number " + std::to_string(protocol) +
               " instead of 0");
  }
  const std::size_t follow = heard.size() - kTcpOverhead + kTcpCounted;
  if (length != follow && IsWholePdu(heard.subspan(kTcpOverhead))) {
    return odd("the header of its replies counts " + std::to_string(length) + " bytes, but " +
               std::to_string(follow) + " follow");
  }
  if (transaction != asked.transaction) {
    return odd("its replies carry another transaction number (" + std::to_string(transaction) +
               ") than their requests (" + std::to_string(asked.transaction) + ")");
  }
  return std::nullopt;
}

/// Explains an exception that answers the request, but whose check value is wrong or missing.
std::optional<Recognised> SpoiledException(const Adu& asked, View heard, std::size_t check) {
  const bool bare = heard.size() == kException;
  if (!bare && heard.size() != kException + check) return std::nullopt;
  const Verdict verdict = CheckReply(asked.pdu, heard.subspan(1, kException - 1));
  if (heard[0] != asked.slave || verdict.outcome != Outcome::refused) return std::nullopt;
  return Recognised{
      Recognised::What::other_setting,
      "it refuses (" + verdict.reason + "), " +
          (bare ? "without a check value" : "with a wrong check value"),
      "check whether the profile fits the device; if it does, update the device's firmware"};
}

}  // namespace

/// Explains a reply whose check value is wrong or missing, or whose check value is correct but the
/// function or count is wrong.
std::optional<Recognised> OtherCheck(Framing framing, const Adu& asked, View heard) {
  const auto other = [](const char* cause) {
    return Recognised{Recognised::What::other_setting, cause,
                      "update the firmware of the device or converter, because one of them does "
                      "not follow the Modbus standard"};
  };
  if (framing == Framing::rtu && heard.size() > kRtuOverhead) {
    if (EndsInCrc16(heard)) {
      return Recognised{Recognised::What::other_reply,
                        "its replies have a correct check value, but a wrong function or count",
                        kNoModbus};
    }
    Bytes swapped(heard.begin(), heard.end());
    std::swap(swapped[swapped.size() - 1], swapped[swapped.size() - 2]);
    if (EndsInCrc16(swapped)) return other("its check value has the high byte first");
    return SpoiledException(asked, heard, kRtuCheck);
  }
  if (framing != Framing::ascii) return std::nullopt;
  const std::string_view text = Trim(AsText(heard));
  const auto bytes = text.starts_with(':') ? ParseHex(text.substr(1)) : std::nullopt;
  if (!bytes || bytes->size() < kException) return std::nullopt;
  if (auto spoiled = SpoiledException(asked, *bytes, kAsciiCheck)) return spoiled;
  const auto length = ReplyLength(View(*bytes).subspan(1));
  const bool bare = length.kind == PduLength::Kind::exact && length.size + 1 == bytes->size();
  if (bare) return other("its replies carry no check value");
  const View body = View(*bytes).first(bytes->size() - 1);
  if (Sum8(body) == bytes->back())
    return other("its check value is the plain sum of the bytes in place of the LRC");
  return std::nullopt;
}

std::optional<Recognised> Recognise(Framing framing, View request, View heard) {
  const auto asked = Unwrap(framing, request);
  if (!asked) return std::nullopt;
  const auto seen = First(framing, heard);
  if (!seen) {
    if (auto other = OtherFraming(framing, heard)) return other;
    return framing == Framing::tcp ? OddHeader(*asked, heard) : OtherCheck(framing, *asked, heard);
  }
  if (seen->request) {
    return Recognised{Recognised::What::other_master,
                      "another master sends on the line: it has asked " + Slave(seen->adu.slave),
                      "a line can have only one master; remove the other, or connect it to the "
                      "gateway as a Modbus client"};
  }
  if (seen->adu.slave != asked->slave) {
    const std::string who = framing == Framing::tcp ? "unit " : "slave ";
    return Recognised{Recognised::What::other_device,
                      who + std::to_string(seen->adu.slave) + " answers where " + who +
                          std::to_string(asked->slave) + " was asked",
                      "check the address that is set at the device"};
  }
  if (framing == Framing::tcp) return OddHeader(*asked, heard);
  const unsigned function = seen->adu.pdu[0] & ~kExceptionBit;
  if (function == asked->pdu[0]) return std::nullopt;
  return Recognised{Recognised::What::other_reply,
                    "its replies have function " + HexByte(static_cast<std::uint8_t>(function)) +
                        " instead of " + HexByte(asked->pdu[0]),
                    kNoModbus};
}

std::optional<std::string> ForeignRtu(View heard) {
  for (std::size_t at = 0; at < heard.size(); ++at) {
    if (!IsPlainRtu(heard.subspan(at))) continue;
    return "messages of Modbus RTU come (" + Slave(heard[at]) + ")";
  }
  return std::nullopt;
}

}  // namespace baudgate::protocols::modbus
