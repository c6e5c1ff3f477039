// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/bundle/archive.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <utility>

namespace baudgate {
namespace {

constexpr std::size_t kBlock = 512;
constexpr std::size_t kLongestName = 90;  // of 100 in a header

std::string SafeName(std::string_view name) {
  std::string safe(name.substr(0, kLongestName));
  for (char& c : safe) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                       std::string_view(".-_/").find(c) != std::string_view::npos;
    if (!plain) c = '_';
  }
  return safe;
}

/// A header of ustar: fields at fixed places, numbers in octal.
std::string HeaderOf(const std::string& name, std::size_t size, WallTime at) {
  std::string header(kBlock, '\0');
  const auto put = [&header](std::size_t place, const std::string& text) {
    header.replace(place, text.size(), text);
  };
  put(0, name.substr(0, kLongestName));
  put(100, "0000600");  // mode
  put(108, "0000000");  // owner
  put(116, "0000000");  // group
  put(124, fmt::format("{:011o}", size));
  put(136, fmt::format("{:011o}", std::max<std::int64_t>(0, at.time_since_epoch() / 1s)));
  put(148, "        ");  // in place of the checksum
  put(156, "0");         // a file
  put(257, "ustar");
  put(263, "00");
  unsigned sum = 0;
  for (const char c : header) sum += static_cast<unsigned char>(c);
  put(148, fmt::format("{:06o}", sum) + std::string(1, '\0') + " ");
  return header;
}

}  // namespace

Archive::Archive(std::string folder, WallTime at) : folder_(std::move(folder)), at_(at) {}

void Archive::Add(std::string_view name, std::string_view content) {
  tar_ += HeaderOf(SafeName(folder_ + "/" + std::string(name)), content.size(), at_);
  tar_ += content;
  tar_.append((kBlock - content.size() % kBlock) % kBlock, '\0');
}

Result<std::string> Archive::Packed() const {
  constexpr int kWithGzipHeader = 15 + 16;
  constexpr int kMemory = 8;
  std::string plain = tar_ + std::string(2 * kBlock, '\0');  // the end of a tar
  z_stream stream{};
  if (::deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kWithGzipHeader, kMemory,
                     Z_DEFAULT_STRATEGY) != Z_OK) {
    return Error{"there is no memory to pack it"};
  }
  std::string packed(::deflateBound(&stream, static_cast<uLong>(plain.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(plain.data());
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int code = ::deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  ::deflateEnd(&stream);
  if (code != Z_STREAM_END) return Error{"it cannot be packed"};
  return packed;
}

}  // namespace baudgate
