// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/assets.h"

#include <zlib.h>

#include <algorithm>
#include <array>

#include "gateway/base/text.h"

namespace baudgate::web {
namespace {

constexpr std::size_t kTrailer = 8;  // of gzip: checksum and length of the content

struct FileType {
  std::string_view ending;
  std::string_view type;
};
constexpr std::array<FileType, 8> kTypes = {{{".html", "text/html; charset=utf-8"},
                                             {".css", "text/css; charset=utf-8"},
                                             {".js", "text/javascript; charset=utf-8"},
                                             {".svg", "image/svg+xml"},
                                             {".png", "image/png"},
                                             {".ico", "image/x-icon"},
                                             {".json", "application/json"},
                                             {".webmanifest", "application/manifest+json"}}};

std::string TagOf(std::string_view packed) {
  std::string tag = "\"";
  for (const char c : packed.substr(packed.size() - std::min(packed.size(), kTrailer))) {
    tag += HexByte(static_cast<std::uint8_t>(c));
  }
  return tag + "\"";
}

/// For the few programs that do not unpack themselves.
std::string Unpacked(std::string_view packed) {
  z_stream stream{};
  if (inflateInit2(&stream, 16 + MAX_WBITS) != Z_OK) return {};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  std::string text;
  std::array<char, 16384> chunk{};
  int step = Z_OK;
  while (step == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
    stream.avail_out = static_cast<uInt>(chunk.size());
    step = inflate(&stream, Z_NO_FLUSH);
    text.append(chunk.data(), chunk.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  return text;
}

bool TakesGzip(const Request& request) {
  return request.Header("accept-encoding").value_or("").find("gzip") != std::string::npos;
}

}  // namespace

std::string_view TypeOf(std::string_view path) {
  const auto found = std::ranges::find_if(
      kTypes, [path](const FileType& type) { return path.ends_with(type.ending); });
  return found == kTypes.end() ? "application/octet-stream" : found->type;
}

std::optional<Response> AssetResponse(const Request& request) {
  const std::string path = request.path == "/" ? "/index.html" : request.path;
  const auto files = PackedFiles();
  const auto found = std::ranges::find(files, std::string_view(path), &PackedFile::path);
  if (found == files.end()) return std::nullopt;
  const std::string_view packed(found->begin, static_cast<std::size_t>(found->end - found->begin));
  const std::string tag = TagOf(packed);
  Response response;
  const bool known = request.Header("if-none-match") == tag;
  if (known) {
    response.status = 304;
  } else if (TakesGzip(request)) {
    response.body = packed;
    response.headers.emplace_back("Content-Encoding", "gzip");
  } else {
    response = TextResponse(200, "", Unpacked(packed));
  }
  if (!known) response.type = TypeOf(path);
  response.headers.emplace_back("ETag", tag);
  response.headers.emplace_back("Vary", "Accept-Encoding");
  response.headers.emplace_back("Cache-Control", "no-cache");
  return response;
}

}  // namespace baudgate::web
