// The files of the page, as they are built into the program: those of gateway/outputs/web/page, and
// the chart library. Each is packed already.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "gateway/outputs/web/request.h"

namespace baudgate::web {

/// What the build has made of a file.
struct PackedFile {
  std::string_view path;  ///< "/index.html"
  const char* begin;      ///< gzip
  const char* end;
};
std::span<const PackedFile> PackedFiles();

/// Empty: there is no such file.
std::optional<Response> AssetResponse(const Request& request);

/// "text/css; charset=utf-8" of "/style.css".
std::string_view TypeOf(std::string_view path);

}  // namespace baudgate::web
