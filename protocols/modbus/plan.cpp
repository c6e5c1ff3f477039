// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/plan.h"

#include <algorithm>
#include <set>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/modbus/codec.h"

namespace baudgate::protocols::modbus {
namespace {

struct FunctionRow {
  Table table;
  std::uint8_t function;
};

constexpr FunctionRow kFunctions[] = {
    {Table::coils, kReadCoils}, {Table::discretes, kReadDiscretes}, {Table::holding, kReadHolding},
    {Table::input, kReadInput}, {Table::status, kExceptionStatus},  {Table::events, kEventCounter},
    {Table::log, kEventLog},    {Table::server, kServerId},         {Table::file, kReadFile},
    {Table::queue, kReadQueue}, {Table::identity, kEncapsulated},
};

constexpr std::uint8_t kFileReference = 6;
// Size of a request for one record: function, byte count, and seven bytes.
constexpr std::size_t kFileRequest = 9;

/// Returns the longest run of printable characters. Example: "MODEL-7" from 07 FF 4D 4F 44 45 4C 2D
/// 37 00.
std::string TextOf(View data) {
  std::string best;
  std::string run;
  for (const std::uint8_t byte : data) {
    const bool shows = byte >= 0x20 && byte < 0x7F;
    if (shows) run += static_cast<char>(byte);
    if (run.size() > best.size()) best = run;
    if (!shows) run.clear();
  }
  return best;
}

void TakeObjects(View reply, Data& data) {
  constexpr std::size_t kMore = 4;
  constexpr std::size_t kObjects = 7;
  if (reply.size() < kObjects) return;
  const std::uint8_t next = reply[kMore + 1];
  if (reply[kMore] == 0xFF && next > data.address) data.follows = next;
  data.whole = !data.follows;
  std::size_t at = kObjects;
  while (at + 1 < reply.size()) {
    const std::size_t size = std::min<std::size_t>(reply[at + 1], reply.size() - at - 2);
    const std::string_view text = AsText(reply.subspan(at + 2, size));
    data.texts[reply[at]] = Trim(text.substr(0, text.find('\0')));
    at += 2 + size;
  }
}

bool TakeTable(View bytes, std::size_t count, Data& data) {
  const bool bits = IsBits(data.space.table);
  if (bytes.size() < (bits ? PackedSize(count) : 2 * count)) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned bit = bits ? (bytes[i / 8] >> (i % 8)) & 1U : 0U;
    data.words.push_back(bits ? static_cast<std::uint16_t>(bit) : U16At(bytes, 2 * i));
  }
  return true;
}

std::uint8_t ReadFunction(Table table) {
  const auto* const row = std::ranges::find(kFunctions, table, &FunctionRow::table);
  return row->function;
}

}  // namespace

std::optional<Table> TableOf(std::uint8_t function) {
  const auto* const row = std::ranges::find(kFunctions, function, &FunctionRow::function);
  return row == std::end(kFunctions) ? std::nullopt : std::optional(row->table);
}

std::string LabelOf(const Space& space, std::size_t address) {
  std::string label(Name(space.table));
  label += ' ';
  if (space.table == Table::file) label += std::to_string(space.which) + ":";
  if (space.table == Table::queue) label += std::to_string(space.which) + " ";
  return label + std::to_string(address);
}

Bytes ReadOf(const Block<Space>& block) {
  const auto [table, which] = block.key;
  Bytes pdu = {ReadFunction(table)};
  switch (table) {
    case Table::status:
    case Table::events:
    case Table::log:
    case Table::server:
      return pdu;
    case Table::queue:
      AppendU16(pdu, which);
      return pdu;
    case Table::identity:
      pdu.push_back(kIdentification);
      pdu.push_back(static_cast<std::uint8_t>(which));
      pdu.push_back(static_cast<std::uint8_t>(block.begin));
      return pdu;
    case Table::file:
      pdu.push_back(kFileRequest - 2);
      pdu.push_back(kFileReference);
      AppendU16(pdu, which);
      break;
    default:
      break;
  }
  AppendU16(pdu, block.begin);
  AppendU16(pdu, block.size());
  return pdu;
}

std::optional<Block<Space>> BlockOf(View request) {
  const auto table = TableOf(request[0]);
  if (!table) return std::nullopt;
  switch (*table) {
    case Table::status:
      return Block<Space>{{*table, 0}, 0, 1, 1};
    case Table::events:
    case Table::log:
    case Table::server:
      return Block<Space>{{*table, 0}, 0, kMaxPdu, 1};
    case Table::queue:
      if (request.size() != 3) return std::nullopt;
      return Block<Space>{{*table, U16At(request, 1)}, 0, kMaxPdu, 1};
    case Table::identity:
      if (request.size() != 4 || request[1] != kIdentification) return std::nullopt;
      return Block<Space>{{*table, request[2]}, request[3], 0x100, 1};
    case Table::file:
      if (request.size() != kFileRequest || request[2] != kFileReference) return std::nullopt;
      return Block<Space>{{*table, U16At(request, 3)},
                          U16At(request, 5),
                          std::size_t{U16At(request, 5)} + U16At(request, 7),
                          1};
    default:
      if (request.size() != 5) return std::nullopt;
      return Block<Space>{
          {*table, 0}, U16At(request, 1), std::size_t{U16At(request, 1)} + U16At(request, 3), 1};
  }
}

std::optional<Data> DataOf(View request, View reply) {
  Data data;
  if (request[0] == kReadWrite) {
    data.address = U16At(request, 1);
    return TakeTable(reply.subspan(2), U16At(request, 3), data) ? std::optional(data)
                                                                : std::nullopt;
  }
  const auto asked = BlockOf(request);
  if (!asked) return std::nullopt;
  data.space = asked->key;
  data.address = asked->begin;
  switch (data.space.table) {
    case Table::status:
      data.words = {reply[1]};
      break;
    case Table::events:
      data.words = WordsFrom(reply, 1);
      break;
    case Table::log:
      data.words = WordsFrom(reply.first(std::min<std::size_t>(reply.size(), 8)), 2);
      data.whole = true;
      break;
    case Table::server: {
      const View bytes = reply.subspan(2);
      data.words.assign(bytes.begin(), bytes.end());
      data.texts[0] = TextOf(bytes);
      data.whole = true;
      break;
    }
    case Table::queue:
      data.words = WordsFrom(reply, 3);
      data.whole = true;
      break;
    case Table::identity:
      TakeObjects(reply, data);
      break;
    case Table::file:
      data.words = WordsFrom(reply, 4);
      break;
    default:
      if (!TakeTable(reply.subspan(2), asked->size(), data)) return std::nullopt;
  }
  return data;
}

namespace {

/// The options limit the size of requests in registers. In requests for bits, 16 bits count as a
/// register, because both take two bytes in the reply.
constexpr std::size_t kBitsForRegister = 16;

std::size_t MostOf(Table table) {
  if (table == Table::file) return kMostOfFile;
  return IsBits(table) ? kMostBits : kMostRegisters;
}

bool MayJoin(const Block<Space>& block, const Block<Space>& next, const Settings& settings) {
  if (!IsAddressed(block.key.table)) return true;
  const bool bits = IsBits(block.key.table);
  const std::size_t most = MostOf(block.key.table);
  const std::size_t size = next.end - block.begin;
  // Overlapping points share a request, unless the request becomes too long.
  if (next.begin < block.end) return size <= most;
  const std::size_t scale = bits ? kBitsForRegister : 1;
  return next.begin - block.end <= settings.hole * scale &&
         size <= std::min(settings.block * scale, most);
}

}  // namespace

std::vector<std::optional<Location>> ReadLocations(std::span<const config::Point> points) {
  std::vector<std::optional<Location>> places;
  places.reserve(points.size());
  for (const config::Point& point : points) {
    places.emplace_back();
    if (point.access == config::Access::write) continue;
    if (auto place = ReadLocation(point)) places.back() = std::move(*place);
  }
  return places;
}

SpacePlan MakePlan(std::span<const config::Point> points,
                   std::span<const std::optional<Location>> places, const Settings& settings,
                   Often is_often) {
  SpacePlan plan(
      {.may_join = [settings](const Block<Space>& block,
                              const Block<Space>& next) { return MayJoin(block, next, settings); },
       .refused = WhenRefused::ask_rarely,
       .is_often = std::move(is_often)});
  for (std::size_t point = 0; point < places.size(); ++point) {
    if (!places[point]) continue;
    plan.Add(points[point].group, point, places[point]->space(), BeginOf(*places[point]),
             EndOf(*places[point]));
  }
  plan.Make();
  return plan;
}

std::vector<Block<Space>> DistinctReads(const SpacePlan& plan) {
  const auto unit_of = [](Table table) { return std::size_t{IsBits(table) ? 8U : 1U}; };
  std::vector<Block<Space>> polled;
  // For each table: the sizes of its polls, in registers; for bits in bytes of eight bits.
  std::map<Table, std::set<std::size_t>> counts;
  for (std::size_t query = 0; query < plan.queries().size(); ++query) {
    const Block<Space>& block = plan.block(query);
    const Table table = block.key.table;
    if (table > Table::input) continue;
    polled.push_back(block);
    counts[table].insert((block.size() + unit_of(table) - 1) / unit_of(table));
  }
  std::vector<Block<Space>> reads;
  std::vector<Block<Space>> beyond;
  for (const Block<Space>& block : polled) {
    const std::size_t unit = unit_of(block.key.table);
    std::size_t count = 1;
    while (counts[block.key.table].contains(count)) ++count;
    const std::size_t begin = std::min(block.begin, std::size_t{0x10000} - count * unit);
    const bool inside = count * unit <= block.size();
    (inside ? reads : beyond).push_back({block.key, begin, begin + count * unit, 1});
  }
  reads.insert(reads.end(), beyond.begin(), beyond.end());
  return reads;
}

}  // namespace baudgate::protocols::modbus
