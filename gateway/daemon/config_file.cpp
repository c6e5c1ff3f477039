// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/config_file.h"

#include <asio/post.hpp>

namespace baudgate {
namespace {

constexpr const char* kNoAnswer = "cannot be read: its disk does not answer";

}  // namespace

ConfigFile::Text ConfigFile::Read() { return calls_.Wait(read_).value_or(Error{kNoAnswer}); }

void ConfigFile::Look(std::function<void(const Text& text)> seen) {
  const bool begun =
      calls_.Offer([this, seen] { asio::post(loop_, [seen, text = read_()] { seen(text); }); });
  if (!begun) seen(Error{kNoAnswer});
}

}  // namespace baudgate
