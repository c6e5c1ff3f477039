// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/telegram.h"

#include "gateway/base/checksum.h"
#include "gateway/base/text.h"
#include "protocols/modbus/named_places.h"
#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

constexpr std::string_view kLrcPlace = "XX";

/// `01 03 00 00 00 01` gives the whole frame.
Result<Bytes> CompleteRtu(View written, const ParsedOptions&) {
  if (written.size() < 2 || written.size() > kMaxRtu) {
    return Error{"a Modbus telegram is slave, function and data in hex, as in '01 03 00 00 00 01'"};
  }
  Bytes frame(written.begin(), written.end());
  if (!Unwrap(Framing::rtu, written)) AppendCrc16(frame);
  if (frame.size() > kMaxRtu) return Error{"a Modbus RTU frame has at most 256 bytes"};
  return frame;
}

/// `:010300000001` and `:010300000001XX` give the whole frame.
Result<Bytes> CompleteAscii(View written, const ParsedOptions&) {
  std::string_view text = Trim(AsText(written));
  const Error wrong{"a Modbus ASCII telegram is ':' and hex, as in ':010300000001XX'"};
  if (!text.starts_with(':')) return wrong;
  text.remove_prefix(1);
  const bool asked_for = text.ends_with(kLrcPlace);
  if (asked_for) text.remove_suffix(kLrcPlace.size());
  const auto bytes = ParseHex(text);
  if (!bytes || bytes->size() < 2 || bytes->size() > kMaxPdu + 2) return wrong;
  if (!asked_for && bytes->size() > 2 && Sum8(*bytes) == 0) {
    return Wrap(Framing::ascii, (*bytes)[0], View(*bytes).subspan(1, bytes->size() - 2));
  }
  return Wrap(Framing::ascii, (*bytes)[0], View(*bytes).subspan(1));
}

bool IsReadPdu(View pdu) {
  if (modbus::IsRead(pdu[0])) return IsCommon(pdu);
  if (pdu[0] == modbus::kServerId) return pdu.size() == 1;
  if (pdu[0] == kDiagnostics) return pdu.size() == 5 && pdu[1] == 0 && pdu[2] == 0;
  return pdu[0] == kEncapsulated && pdu.size() == 4 && pdu[1] == kIdentification;
}

template <Framing kFraming>
bool IsReadFrame(View request, const ParsedOptions&) {
  const auto adu = Unwrap(kFraming, request);
  return adu && adu->slave != 0 && IsReadPdu(adu->pdu);
}

constexpr TelegramRule kRtu = {"", CompleteRtu, IsReadFrame<Framing::rtu>};
constexpr TelegramRule kAscii = {":", CompleteAscii, IsReadFrame<Framing::ascii>};

}  // namespace

const TelegramRule* TelegramOf(Framing framing) {
  if (framing == Framing::tcp) return nullptr;
  return framing == Framing::rtu ? &kRtu : &kAscii;
}

}  // namespace baudgate::protocols::modbus
