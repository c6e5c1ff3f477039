// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/twin.h"

#include <algorithm>
#include <cmath>

#include "protocols/modbus/plan.h"

namespace baudgate::protocols::modbus {
namespace {

constexpr std::size_t kMostReadWritten = 121;

Registers Bits(View bytes, std::size_t count) {
  Registers words(count);
  for (std::size_t i = 0; i < count; ++i) {
    words[i] = static_cast<std::uint16_t>((bytes[i / 8] >> (i % 8)) & 1U);
  }
  return words;
}

bool Overlap(const Location& place, std::size_t from, std::size_t to) {
  return place.address < to && place.end() > from;
}

bool IsIn(const Location& place, const Space& space, std::size_t address) {
  return place.space() == space && Overlap(place, address, address + 1);
}

bool SameLocation(const Location& a, const Location& b) {
  return a.space() == b.space() && a.address == b.address && a.count == b.count;
}

/// Returns the layer in which the simulated device draws a location into registers; a later layer
/// overwrites an earlier one. 0: texts of codes; 1: bits; 2: whole numbers; 3: numbers with a scale
/// register, so that number and scale agree.
int Layer(const Location& place) {
  if (place.scale) return 3;
  if (place.form == Form::text) return 0;
  return place.form == Form::bit || place.form == Form::bits ? 1 : 2;
}
constexpr int kLayers = 4;

/// The exponent in every scale register of a simulated device: -1, for tenths.
constexpr int kScale = -1;

}  // namespace

ModbusTwin::ModbusTwin(Framing framing, const config::Device& device, TwinValues& values)
    : framing_(framing),
      device_(device),
      settings_(ReadSettings(device.options)),
      slave_(ParseAddress(device.address, framing).value()),
      reply_as_(slave_),
      points_(device, values, ReadLocation, WriteLocation) {}

void ModbusTwin::ReplyAs(std::string_view address) {
  reply_as_ = ParseAddress(address, framing_).value();
}

Bytes ModbusTwin::Answer(View request, Instant now) {
  const auto adu = Unwrap(framing_, request);
  const bool broadcast = adu && IsBroadcast(framing_, adu->slave);
  const bool mine = adu && (adu->slave == slave_ || broadcast);
  if (!mine || adu->pdu[0] == 0 || adu->pdu[0] >= kExceptionBit) return {};
  const Bytes reply = AnswerPdu(adu->pdu, now);
  if (broadcast) return {};
  return Wrap(framing_, reply_as_, reply, adu->transaction);
}

Bytes ModbusTwin::AnswerPdu(View pdu, Instant now) {
  const std::uint8_t function = pdu[0];
  const auto length = RequestLength(pdu);
  if (length.kind == PduLength::Kind::need_more ||
      (length.kind == PduLength::Kind::exact && length.size != pdu.size())) {
    return Exception(function, kIllegalValue);
  }
  switch (function) {
    case kReadCoils:
    case kReadDiscretes:
    case kReadHolding:
    case kReadInput:
      return Read(pdu, now);
    case kWriteCoil:
    case kWriteRegister:
    case kWriteCoils:
    case kWriteRegisters:
      return Write(pdu, now);
    case kDiagnostics:
      if (IsMirrored(pdu)) return {pdu.begin(), pdu.end()};
      return Exception(function, kIllegalFunction);
    case kMaskWrite:
      return MaskWrite(pdu, now);
    case kReadWrite:
      return ReadWrite(pdu, now);
    case kExceptionStatus:
    case kEventCounter:
    case kEventLog:
    case kServerId:
    case kReadQueue:
    case kReadFile:
      return ReadOne(pdu, now);
    case kEncapsulated:
      return Identify(pdu, now);
    default:
      return Exception(function, kIllegalFunction);
  }
}

Bytes ModbusTwin::Read(View pdu, Instant now) const {
  const Table table = *TableOf(pdu[0]);
  const std::size_t address = U16At(pdu, 1);
  const std::size_t count = U16At(pdu, 3);
  if (count < 1 || count > (IsBits(table) ? kMostBits : kMostRegisters)) {
    return Exception(pdu[0], kIllegalValue);
  }
  const Image image = ImageOf({table, 0}, address, count, now);
  if (image.end() > 0x10000 || !Allows(image.there)) return Exception(pdu[0], kIllegalAddress);
  const std::vector<bool> bits(image.words.begin(), image.words.end());
  const Bytes data = IsBits(table) ? PackBits(bits) : BytesOf(image.words);
  Bytes reply = {pdu[0], static_cast<std::uint8_t>(data.size())};
  Append(reply, data);
  return reply;
}

bool ModbusTwin::Allows(const std::vector<bool>& there) const {
  const auto is = [](bool one) { return one; };
  return settings_.missing_zero ? std::ranges::any_of(there, is) : std::ranges::all_of(there, is);
}

ModbusTwin::Image ModbusTwin::ImageOf(const Space& space, std::size_t address, std::size_t count,
                                      Instant now) const {
  Image image{space, address, Registers(count), std::vector<bool>(count)};
  for (int layer = 0; layer < kLayers; ++layer) {
    for (const auto& point : points_.all()) {
      if (point.read && Layer(*point.read) == layer) Draw(point, image, now);
    }
  }
  // A write-only register exists, too: it reads 0, instead of an exception.
  for (const auto& point : points_.all()) {
    for (std::size_t i = 0; point.write && i < count; ++i) {
      if (IsIn(*point.write, space, address + i)) image.there[i] = true;
    }
  }
  return image;
}

void ModbusTwin::Draw(const TwinPoints<Location>::One& point, Image& image, Instant now) const {
  const Location& place = *point.read;
  const bool here =
      place.space() == image.space && BeginOf(place) < image.end() && EndOf(place) > image.address;
  if (!here || place.form == Form::object) return;
  Value value = points_.Get(point, now);
  if (place.scale && HasValue(value)) value = std::round(ToDouble(value) * std::pow(10, -kScale));
  Registers words(place.count);
  std::uint16_t mask = 0xFFFF;
  if (place.form == Form::text) {
    words[0] = CodeOf(place, value, settings_).value_or(0);
  } else if (place.form == Form::bits || place.form == Form::bit || place.form == Form::flag) {
    const unsigned most = (1U << place.width) - 1U;
    const double number = ToDouble(value);
    const auto level =
        static_cast<unsigned>(number >= 0.5 ? std::min(number + 0.5, 1.0 * most) : 0);
    words[0] = static_cast<std::uint16_t>(level << place.bit);
    if (place.form != Form::flag) mask = static_cast<std::uint16_t>(most << place.bit);
  } else if (const auto encoded = Encode(place, value, settings_)) {
    words = *encoded;
  }
  const auto put = [&](std::size_t at, std::uint16_t word) {
    if (at < image.address || at >= image.end()) return;
    std::uint16_t& old = image.words[at - image.address];
    old = static_cast<std::uint16_t>((old & ~mask) | word);
    image.there[at - image.address] = true;
  };
  for (std::size_t i = 0; i < words.size(); ++i) put(place.address + i, words[i]);
  if (place.scale) put(*place.scale, static_cast<std::uint16_t>(kScale));
}

Bytes ModbusTwin::Write(View pdu, Instant now) {
  const std::uint8_t function = pdu[0];
  const std::size_t address = U16At(pdu, 1);
  const std::size_t second = U16At(pdu, 3);
  const bool coils = function == kWriteCoil || function == kWriteCoils;
  Registers words;
  if (function == kWriteCoil) {
    if (second != 0 && second != 0xFF00) return Exception(function, kIllegalValue);
    words = {static_cast<std::uint16_t>(second == 0 ? 0 : 1)};
  } else if (function == kWriteRegister) {
    words = {static_cast<std::uint16_t>(second)};
  } else {
    const bool known = RequestLength(pdu).kind == PduLength::Kind::exact;
    const std::size_t most = coils ? kMostWrittenBits : kMostWrittenRegisters;
    if (!known || second < 1 || second > most) return Exception(function, kIllegalValue);
    words = coils ? Bits(pdu.subspan(6), second) : WordsFrom(pdu, 6);
  }
  const std::uint8_t refused = Store(coils ? Table::coils : Table::holding, address, words, now);
  if (refused != 0) return Exception(function, refused);
  const View echoed = pdu.first(5);
  return {echoed.begin(), echoed.end()};
}

std::uint8_t ModbusTwin::Store(Table table, std::size_t address, const Registers& words,
                               Instant now) {
  const std::size_t end = address + words.size();
  if (end > 0x10000) return kIllegalAddress;
  const Space space{table, 0};
  std::vector<bool> writable(words.size());
  for (std::size_t i = 0; i < words.size(); ++i) {
    writable[i] = points_.FindWritable([&](const Location& place) {
      return IsIn(place, space, address + i);
    }) != nullptr;
  }
  const std::vector<bool> there = ImageOf(space, address, words.size(), now).there;
  if (!Allows(settings_.missing_zero ? there : writable)) return kIllegalAddress;
  // All changes are computed before the first is stored, so that no point is decoded from a
  // register that another point has already changed.
  std::vector<std::pair<const TwinPoints<Location>::One*, Value>> changes;
  for (const auto& point : points_.all()) {
    const auto is_here = [&](const Location& place) { return SameLocation(place, *point.read); };
    const bool shown = !point.write && point.read && points_.FindWritable(is_here) != nullptr;
    const auto& place = shown ? point.read : point.write;
    if (!place || place->space() != space || place->scale || !Overlap(*place, address, end))
      continue;
    Image image = ImageOf(space, place->address, place->count, now);
    for (std::size_t i = 0; i < words.size(); ++i) {
      const std::size_t at = address + i;
      if (at >= image.address && at < image.end()) image.words[at - image.address] = words[i];
    }
    auto decoded = Decode(*place, image.words, settings_);
    if (HasValue(decoded.value)) changes.emplace_back(&point, std::move(decoded.value));
  }
  for (const auto& [point, value] : changes) points_.Set(*point, value);
  return 0;
}

Bytes ModbusTwin::MaskWrite(View pdu, Instant now) {
  const std::size_t address = U16At(pdu, 1);
  const std::size_t keep = U16At(pdu, 3);
  const std::size_t set = U16At(pdu, 5);
  const std::size_t old = ImageOf({Table::holding, 0}, address, 1, now).words[0];
  const auto word = static_cast<std::uint16_t>((old & keep) | (set & ~keep & 0xFFFFU));
  const std::uint8_t refused = Store(Table::holding, address, {word}, now);
  if (refused != 0) return Exception(pdu[0], refused);
  return {pdu.begin(), pdu.end()};
}

Bytes ModbusTwin::ReadWrite(View pdu, Instant now) {
  const std::size_t written = U16At(pdu, 7);
  const bool known = RequestLength(pdu).kind == PduLength::Kind::exact;
  if (!known || written < 1 || written > kMostReadWritten) {
    return Exception(pdu[0], kIllegalValue);
  }
  Bytes read = ReadRequest(kReadHolding, static_cast<std::uint16_t>(U16At(pdu, 1)), U16At(pdu, 3));
  Bytes reply = Read(read, now);
  if (reply[0] >= kExceptionBit) return Exception(pdu[0], reply[1]);
  const std::uint8_t refused = Store(Table::holding, U16At(pdu, 5), WordsFrom(pdu, 10), now);
  if (refused != 0) return Exception(pdu[0], refused);
  reply = Read(read, now);
  reply[0] = pdu[0];
  return reply;
}

namespace {

constexpr std::size_t kLongestTitle = 64;

}  // namespace

Bytes ModbusTwin::ReadOne(View pdu, Instant now) const {
  const auto asked = protocols::modbus::BlockOf(pdu);
  if (!asked) return Exception(pdu[0], kIllegalValue);
  const Space& space = asked->key;
  const bool file = space.table == Table::file;
  const bool speaks = space.table == Table::server && !device_.identity.names.empty();
  const std::size_t count = file ? asked->size() : CountOf(space);
  if (count == 0 && !speaks) return Exception(pdu[0], kIllegalFunction);
  if (file && count > kMostOfFile) return Exception(pdu[0], kIllegalValue);
  const Image image = ImageOf(space, file ? asked->begin : 0, count, now);
  const auto byte = [](std::size_t value) { return static_cast<std::uint8_t>(value & 0xFFU); };
  Bytes reply = {pdu[0]};
  switch (space.table) {
    case Table::status:
      reply.push_back(byte(image.words[0]));
      return reply;
    case Table::events:
      Append(reply, BytesOf({image.words[0], count > 1 ? image.words[1] : std::uint16_t{0}}));
      return reply;
    case Table::log:
      reply.push_back(6);
      Append(reply, BytesOf(image.words));
      return reply;
    case Table::server: {
      Bytes says;
      for (const std::uint16_t word : image.words) says.push_back(byte(word));
      says.push_back(0xFF);  // run indicator: on
      Append(says, std::string_view(SaysOf(Table::server, 0, now)));
      reply.push_back(byte(says.size()));
      Append(reply, says);
      return reply;
    }
    case Table::queue: {
      const bool told = points_.Find(
          [&](const Location& place) { return place.space() == space && place.address == 0; });
      const std::size_t queued =
          told ? std::min<std::size_t>(image.words[0], count - 1) : count - 1;
      AppendU16(reply, 2 + 2 * queued);
      AppendU16(reply, queued);
      Append(reply, BytesOf({image.words.begin() + 1,
                             image.words.begin() + 1 + static_cast<std::ptrdiff_t>(queued)}));
      return reply;
    }
    default: {
      if (!Allows(image.there)) return Exception(pdu[0], kIllegalAddress);
      const Bytes data = BytesOf(image.words);
      reply.push_back(byte(data.size() + 2));
      reply.push_back(byte(data.size() + 1));
      reply.push_back(pdu[2]);
      Append(reply, data);
      return reply;
    }
  }
}

std::size_t ModbusTwin::CountOf(const Space& space) const {
  std::size_t count = 0;
  for (const auto& point : points_.all()) {
    if (point.read && point.read->space() == space) count = std::max(count, point.read->end());
  }
  // The reply to function 12 always contains three words, whether points read them or not.
  if (count > 0 && space.table == Table::log) count = 3;
  return count;
}

/// Returns the text of an object or of the server id: the value of the point, or a default from the
/// device's configuration. Empty: the device has no such object.
std::string ModbusTwin::SaysOf(Table table, std::size_t object, Instant now) const {
  const auto* const point = points_.Find([&](const Location& place) {
    return place.table == table && place.form == Form::object && place.address == object;
  });
  if (point != nullptr) return ToText(points_.Get(*point, now)).substr(0, kLongestTitle);
  const auto& names = device_.identity.names;
  const std::string title = !names.empty()          ? names.front()
                            : device_.title.empty() ? device_.name
                                                    : device_.title;
  constexpr std::size_t kProduct = 1;
  if (table == Table::server || object == kProduct) return title.substr(0, kLongestTitle);
  if (object == 0) return "baudgate";
  return object == 2 ? "1.0" : "";
}

/// Returns the reply with one object, or with all objects of a category from the requested one on,
/// as many as fit.
Bytes ModbusTwin::Identify(View pdu, Instant now) const {
  if (pdu.size() != 4 || pdu[1] != kIdentification) {
    return Exception(pdu[0], kIllegalFunction);
  }
  constexpr std::uint8_t kOne = 4;
  // Ends of the basic, regular and extended objects.
  constexpr std::size_t kEnds[] = {0x03, 0x80, 0x100};
  if (pdu[2] < 1 || pdu[2] > kOne) return Exception(pdu[0], kIllegalValue);
  const bool one = pdu[2] == kOne;
  std::size_t id = pdu[3];
  if (SaysOf(Table::identity, id, now).empty()) {
    if (one) return Exception(pdu[0], kIllegalAddress);
    id = 0;
  }
  const std::size_t end = one ? id + 1 : kEnds[pdu[2] - 1];
  const auto has = [&](std::size_t from, std::size_t to) {
    while (from < to && SaysOf(Table::identity, from, now).empty()) ++from;
    return from < to;
  };
  const std::uint8_t conformity = has(kEnds[1], kEnds[2])   ? 0x83
                                  : has(kEnds[0], kEnds[1]) ? 0x82
                                                            : 0x81;
  Bytes reply = {pdu[0], pdu[1], pdu[2], conformity, 0, 0, 0};
  for (; id < end; ++id) {
    const std::string text = SaysOf(Table::identity, id, now);
    if (text.empty()) continue;
    if (reply.size() + 2 + text.size() > kMaxPdu) {
      reply[4] = 0xFF;
      reply[5] = static_cast<std::uint8_t>(id);
      break;
    }
    ++reply[6];
    reply.push_back(static_cast<std::uint8_t>(id));
    reply.push_back(static_cast<std::uint8_t>(text.size()));
    Append(reply, text);
  }
  return reply;
}

}  // namespace baudgate::protocols::modbus
