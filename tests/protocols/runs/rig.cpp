// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/rig.h"

#include <algorithm>
#include <cmath>

#include "config/loader.h"
#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/assembler.h"
#include "protocols/dcon/protocol.h"
#include "protocols/modbus/protocol.h"
#include "protocols/set4tm/protocol.h"
#include "protocols/spabus/protocol.h"

namespace baudgate::protocols {
namespace {

config::SerialSettings Serial(int baud, int data_bits, config::Parity parity) {
  config::SerialSettings serial;
  serial.baud = baud;
  serial.data_bits = data_bits;
  serial.parity = parity;
  return serial;
}

std::string PlaceOf(const std::string& read) {
  const auto at = read.rfind('@');
  if (at == std::string::npos || at == 0) return read;
  return read.substr(0, read.rfind(' ')) + read.substr(at);
}

double NumberOf(const config::Point& point, std::size_t device) {
  const config::Simulate& range = *point.simulate;
  const std::uint16_t share = Crc16(ToBytes(PlaceOf(point.read) + " " + std::to_string(device)));
  return range.low + (range.high - range.low) * share / 65536.0;
}

/// True for points whose values the test cannot choose, because they depend on other points or on
/// the simulated device's configuration.
bool IsDerived(const config::Point& point) {
  return point.read.ends_with("alarm@0") || point.read.starts_with("08 0A u") ||
         point.read == "$B" || point.read.starts_with("08 00 u32") ||
         point.read.starts_with("08 05 u8");
}

bool Matches(const config::Point& point, const Value& shown, const Value& raw) {
  if (point.type == config::Type::string) return ToText(shown) == ToText(raw);
  const double expected = (ToDouble(raw) * point.scale + point.offset).ToDouble();
  const bool register_count = point.read.find(" energy@") != std::string::npos;
  const double step = register_count ? 0.1 : 0.001;
  return std::abs(ToDouble(shown) - expected) <= std::abs(expected) * 1e-4 + step;
}

bool SpaGood(View frame) {
  const std::string_view text = AsText(frame);
  const auto start = text.find('<');
  const auto colon = text.rfind(':');
  if (start == std::string_view::npos || colon == std::string_view::npos) return false;
  std::uint8_t sum = 0;
  for (const char c : text.substr(start, colon + 1 - start)) sum ^= static_cast<std::uint8_t>(c);
  const std::string_view sent = text.substr(colon + 1, 2);
  return sent == HexByte(sum) || sent == "XX";
}

bool DconGood(View frame) {
  const std::string_view text = AsText(frame);
  return text.size() > 3 && text.back() == '\r' &&
         text.substr(text.size() - 3, 2) == HexByte(Sum8(frame.first(frame.size() - 3)));
}

bool CrcGood(View frame) {
  if (frame.size() < 4) return false;
  const std::size_t body = frame.size() - 2;
  return ByteReader(frame).U16Le(body) == Crc16(frame.first(body));
}

bool LrcGood(View frame) {
  const std::string_view text = AsText(frame);
  const auto start = text.rfind(':');
  if (start == std::string_view::npos || !text.ends_with("\r\n")) return false;
  const auto bytes = ParseHex(text.substr(start + 1, text.size() - start - 3));
  return bytes && Sum8(*bytes) == 0;
}

/// Modbus TCP has no check value, so only its header is checked.
bool HeaderGood(View frame) {
  return frame.size() > 7 && ByteReader(frame).U16Be(2) == 0 &&
         ByteReader(frame).U16Be(4) == frame.size() - 6;
}

bool Any(config::Group) { return true; }
bool Fast(config::Group group) { return group == config::Group::fast; }

}  // namespace

const std::vector<Setup>& RealLines() {
  using config::Parity;
  static const std::vector<Setup> lines = {
      {"Spa9600",
       &SpabusProtocol(),
       SpaGood,
       "spaj140c",
       Serial(9600, 7, Parity::even),
       {"1", "2"},
       {}},
      {"Dcon115200",
       &DconProtocol(),
       DconGood,
       "owen-mv110-8a",
       Serial(115200, 8, Parity::none),
       {"1", "2"},
       {}},
      {"Dcon9600",
       &DconProtocol(),
       DconGood,
       "adam-4018plus",
       Serial(9600, 8, Parity::none),
       {"1", "0x4A"},
       {{"checksum", true}}},
      {"Set4tm9600",
       &Set4tmProtocol(),
       CrcGood,
       "set-4tm.03m",
       Serial(9600, 8, Parity::odd),
       {"200", "5"},
       {{"snapshot", std::string("false")}}},
      {"Set4tmSnapshot",
       &Set4tmProtocol(),
       CrcGood,
       "set-4tm.03m",
       Serial(9600, 8, Parity::odd),
       {"200", "sn:9020077"},
       {{"snapshot", std::string("true")}}},
      {"ModbusRtu19200",
       &ModbusRtuProtocol(),
       CrcGood,
       "generic-meter",
       Serial(19200, 8, Parity::even),
       {"20", "0x15"},
       {}},
      {"ModbusAscii9600",
       &ModbusAsciiProtocol(),
       LrcGood,
       "generic-meter",
       Serial(9600, 7, Parity::even),
       {"1", "2"},
       {{"order", std::string("CDAB")}}},
  };
  return lines;
}

const Setup& TcpLine() {
  static const Setup line = {"ModbusTcp",
                             &ModbusTcpProtocol(),
                             HeaderGood,
                             "generic-meter",
                             ModbusTcpProtocol().serial,
                             {"0", "255"},
                             {}};
  return line;
}

const Setup& RealLine(const std::string& name) {
  return *std::find_if(RealLines().begin(), RealLines().end(),
                       [&](const Setup& setup) { return setup.name == name; });
}

HeardReply Hear(const Protocol& protocol, const config::Options& options, View request,
                View bytes) {
  Assembler assembler;
  assembler.Begin(protocol.reply_rule, protocol.expect(request, ParseOptions(protocol, options)));
  assembler.Feed(bytes);
  HeardReply heard;
  heard.frame = assembler.Next(false);
  if (!heard.frame) heard.frame = assembler.Next(true);
  heard.blame = assembler.blame();
  return heard;
}

bool EchoHides(const Protocol& protocol, const config::Options& options, View request, View reply) {
  Bytes both(request.begin(), request.end());
  Append(both, reply);
  return Hear(protocol, options, request, both).frame !=
         Hear(protocol, options, request, reply).frame;
}

/// Limits the number of points that are read once a day; more would not improve the test.
void KeepFewDaily(std::vector<config::Point>& points) {
  constexpr int kMost = 40;
  int daily = 0;
  std::erase_if(points, [&](const config::Point& point) {
    return point.group == config::Group::daily && ++daily > kMost;
  });
}

config::Line LineOf(const Setup& setup) {
  config::Catalog catalog;
  const std::string protocol(setup.protocol->name);
  catalog.protocols[protocol] = setup.protocol;
  catalog.profile_dirs = {"config/profiles"};
  const auto loaded = config::LoadProfile(setup.profile, *setup.protocol, catalog);
  for (const config::Problem& problem : loaded.problems) ADD_FAILURE() << ToString(problem);
  config::Line line;
  line.name = "line";
  line.protocol = protocol;
  line.serial = setup.serial;
  for (const std::string& address : setup.addresses) {
    config::Device device =
        config::DeviceFromProfile(loaded.profile, *setup.protocol, "device-" + address, address);
    KeepFewDaily(device.points);
    std::erase_if(device.points,
                  [](const config::Point& point) { return point.access == config::Access::write; });
    for (const auto& [name, value] : setup.options) device.options.Set(name, value);
    line.options = device.options;
    line.devices.push_back(std::move(device));
  }
  return line;
}

Rig::Rig(const Setup& setup, const std::function<void(config::Line&)>& change) : setup_(setup) {
  config::Line line = LineOf(setup);
  if (change) change(line);
  line_ = std::make_unique<VirtualLine>(std::move(line), std::vector{setup.protocol});
  for (std::uint32_t i = 0; i < devices(); ++i) SetValues(i);
}

void Rig::SetValues(std::uint32_t device) {
  const auto& points = this->device(device).points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const config::Point& point = points[i];
    if (!point.simulate) continue;
    Value value;
    if (point.simulate->text) {
      value = *point.simulate->text;
    } else if (point.type == config::Type::boolean) {
      value = (point.simulate->low != 0) != (i % 3 == device);
    } else {
      double number = NumberOf(point, device);
      if (point.type < config::Type::float32) number = std::round(number);
      value = ((number - point.offset) / point.scale).ToDouble();
    }
    line_->twin(device).values.Set(i, value);
  }
}

void Rig::CompareWithTwin(std::uint32_t device) {
  const auto& points = this->device(device).points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (IsDerived(points[i])) continue;
    Value raw = line_->twin(device).values.Get(i, {});
    const config::Options& options = this->device(device).options;
    if (points[i].read == "$2" && options.Flag("checksum")) {
      raw = ToText(raw).replace(4, 2, "40");
    }
    EXPECT_TRUE(Matches(points[i], truth_[device][i], raw))
        << points[i].name << " shows " << ToText(truth_[device][i]) << ", the twin has "
        << ToText(raw);
  }
}

bool Rig::IsRight(const config::Point& point, const bus::PointRecord& shown, const Value& truth) {
  if (IsBad(shown.reported) || shown.value == truth) return true;
  if (point.recheck == config::Recheck::off) return false;
  // A small change is accepted without a second reading. So damage can pass as a change.
  if (!IsGood(shown.reported)) return true;
  if (point.type == config::Type::boolean || point.type == config::Type::string) return false;
  return std::abs(ToDouble(shown.value) - ToDouble(truth)) <= std::abs(ToDouble(truth)) * 0.12;
}

void Rig::LearnTruth() {
  line_->Open();
  EXPECT_TRUE(line_->RunUntil([this] { return AllGood(); }, 2min)) << "not every point became good";
  for (std::uint32_t device = 0; device < devices(); ++device) {
    truth_.emplace_back();
    line_->store().Read(device, [&](const bus::DeviceRecord& record) {
      for (const bus::PointRecord& point : record.points) truth_.back().push_back(point.value);
    });
    CompareWithTwin(device);
  }
}

void Rig::Watch(std::function<bool(std::uint32_t)> excuse) {
  ASSERT_EQ(truth_.size(), devices()) << "LearnTruth comes first";
  excuse_ = std::move(excuse);
  exchanges_.assign(devices(), 0);
  seen_.clear();
  for (const auto& points : truth_) seen_.emplace_back(points.size());
  line_->always = [this] { Check(); };
}

void Rig::Check() {
  for (std::uint32_t device = 0; device < devices(); ++device) {
    std::vector<std::size_t> news;
    std::vector<Value> values;
    line_->store().Read(device, [&](const bus::DeviceRecord& record) {
      if (std::exchange(exchanges_[device], record.status.exchanges) == record.status.exchanges)
        return;
      for (std::size_t i = 0; i < record.points.size(); ++i) {
        const bus::PointRecord& point = record.points[i];
        if (std::exchange(seen_[device][i], point.seq) == point.seq) continue;
        if (IsRight(record.device->points[i], point, truth_[device][i])) continue;
        news.push_back(i);
        values.push_back(point.value);
      }
    });
    if (news.empty()) continue;
    wrong_ += news.size();
    if (excuse_ && excuse_(device)) continue;
    for (std::size_t i = 0; i < news.size(); ++i) {
      ADD_FAILURE() << this->device(device).name << " " << this->device(device).points[news[i]].name
                    << " shows " << ToText(values[i]) << " in place of "
                    << ToText(truth_[device][news[i]]) << " after "
                    << FormatDuration(line_->elapsed());
    }
  }
}

bool Rig::All(std::uint32_t device, const Pick& pick, const Demand& demand) {
  bool all = true;
  line_->store().Read(device, [&](const bus::DeviceRecord& record) {
    for (std::size_t i = 0; i < record.points.size() && all; ++i) {
      if (!pick(record.device->points[i].group)) continue;
      all = demand(QualityAt(record, i, line_->now().instant));
    }
  });
  return all;
}

bool Rig::AllGood(std::uint32_t device) { return All(device, Any, IsGood); }

bool Rig::AllGood() {
  for (std::uint32_t device = 0; device < devices(); ++device) {
    if (!AllGood(device)) return false;
  }
  return true;
}

bool Rig::FastGood(std::uint32_t device) { return All(device, Fast, IsGood); }

bool Rig::FastUsable(std::uint32_t device) {
  return All(device, Fast, [](Quality quality) { return !IsBad(quality); });
}

bool Rig::AnyUsable(std::uint32_t device) { return !All(device, Any, IsBad); }

}  // namespace baudgate::protocols
