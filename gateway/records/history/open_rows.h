// Entries that stand in a day's file as rows, in memory once more in few bytes each, by point: what
// chunks are made of without reading the rows again.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/records/history/batch.h"

namespace baudgate::history {

struct Chunk {
  PointNumber point = 0;
  std::int64_t run = 0;
  Millis first = 0;
  Millis last = 0;
  std::int64_t count = 0;
  Bytes bytes;
};

class OpenRows {
 public:
  /// Entries that do not come after the last one of their point and run are left out.
  void Add(const Sample& sample);
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  Millis oldest() const { return oldest_; }  ///< of those that are there

  /// Takes about so many entries out, as chunks. False: there was no memory for it.
  bool Pack(std::size_t entries, std::vector<Chunk>& out);

 private:
  struct Row {
    std::uint64_t bits = 0;
    std::uint32_t after = 0;  // milliseconds after the begin
    std::uint16_t quality = 0;
    std::uint8_t kind = 0;  // of Value
  };
  struct Series {
    PointNumber point = 0;
    std::int64_t run = 0;
    Millis begin = 0;
    std::vector<Row> rows;
    std::vector<std::string> texts;
  };
  static Entry EntryOf(const Series& series, const Row& row);

  std::vector<Series> current_;  // by point
  std::vector<Series> full_;     // of an earlier run, or as long as a chunk may be
  std::size_t packed_ = 0;       // of current_
  std::size_t size_ = 0;
  Millis oldest_ = 0;
};

}  // namespace baudgate::history
