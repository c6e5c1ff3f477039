// What stands in a tar.gz, by name: a reader of its own, which checks the checksums.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <map>
#include <string>

namespace baudgate {

inline std::string Gunzipped(std::string packed) {
  z_stream stream{};
  if (::inflateInit2(&stream, 15 + 16) != Z_OK) return {};
  std::string plain(16 * 1024 * 1024, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(plain.data());
  stream.avail_out = static_cast<uInt>(plain.size());
  EXPECT_EQ(::inflate(&stream, Z_FINISH), Z_STREAM_END);
  plain.resize(stream.total_out);
  ::inflateEnd(&stream);
  return plain;
}

inline std::map<std::string, std::string> Unpacked(const std::string& packed) {
  constexpr std::size_t kBlock = 512;
  const std::string tar = Gunzipped(packed);
  EXPECT_EQ(tar.size() % kBlock, 0U);
  std::map<std::string, std::string> files;
  for (std::size_t at = 0; at + kBlock <= tar.size() && tar[at] != '\0';) {
    const std::string header = tar.substr(at, kBlock);
    const auto number = [&](std::size_t place) {
      return std::stoul(header.substr(place, 12), nullptr, 8);
    };
    EXPECT_EQ(header.substr(257, 5), "ustar");
    unsigned long sum = 0;
    for (std::size_t i = 0; i < kBlock; ++i) {
      sum +=
          i >= 148 && i < 156 ? static_cast<unsigned>(' ') : static_cast<unsigned char>(header[i]);
    }
    EXPECT_EQ(std::stoul(header.substr(148, 6), nullptr, 8), sum);
    const std::size_t size = number(124);
    files[header.c_str()] = tar.substr(at + kBlock, size);
    at += kBlock + (size + kBlock - 1) / kBlock * kBlock;
  }
  return files;
}

}  // namespace baudgate
