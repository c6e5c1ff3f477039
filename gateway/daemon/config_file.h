// The configuration file of the user, which is only read. No caller waits long for its disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <functional>
#include <string>
#include <utility>

#include "gateway/base/result.h"
#include "gateway/records/disk/disk_calls.h"

namespace baudgate {

/// All is called on one thread, or while it does not run: that of `loop`.
class ConfigFile {
 public:
  using Text = Result<std::string>;

  /// `read`: on a thread of its own.
  ConfigFile(asio::io_context& loop, std::function<Text()> read, Duration patience)
      : loop_(loop), read_(std::move(read)), calls_("configuration", patience) {}

  Text Read();
  /// `seen` gets the text, later or at once.
  void Look(std::function<void(const Text& text)> seen);
  /// As long as the disk takes. Idempotent.
  void Stop() { calls_.Stop(); }

 private:
  asio::io_context& loop_;
  const std::function<Text()> read_;
  DiskCalls calls_;
};

}  // namespace baudgate
