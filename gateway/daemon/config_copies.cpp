// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/config_copies.h"

#include <asio/post.hpp>
#include <utility>

#include "gateway/base/log.h"

namespace baudgate {
namespace {

Error NoAnswer(const std::string& folder) {
  return Error{folder + " cannot be used: its disk does not answer"};
}

}  // namespace

ConfigCopies::ConfigCopies(asio::io_context& loop, std::optional<reload::KeptConfigs> kept,
                           Duration patience, std::function<Status()> open_folder)
    : loop_(loop),
      kept_(std::move(kept)),
      open_folder_(std::move(open_folder)),
      calls_("config copies", patience) {}

Status ConfigCopies::Open() {
  if (open_) return {};
  if (!kept_) return Error{"there is no state folder; give one with gateway.state"};
  Status status = open_folder_();
  open_ = status.ok();
  return status;
}

Status ConfigCopies::Keep(const reload::KeptTexts& texts) {
  if (Status status = Open(); !status) return status;
  const auto written = calls_.Wait([kept = *kept_, texts] { return kept.Write(texts); });
  if (!written) return NoAnswer(folder());
  return *written ? Status() : Status(Error{written->error()});
}

void ConfigCopies::Look(const reload::KeptTexts& texts,
                        std::function<void(std::optional<std::string> trouble)> seen) {
  if (!open_) return;
  const bool begun = calls_.Offer([this, kept = *kept_, texts, seen] {
    asio::post(loop_, [this, seen, written = kept.Write(texts)] { seen(Trouble(written)); });
  });
  if (!begun) seen(Trouble(NoAnswer(folder())));
}

std::optional<std::string> ConfigCopies::Trouble(const Result<bool>& written) {
  const auto before = std::move(trouble_);
  trouble_ = written ? std::optional<std::string>() : written.error();
  if (trouble_ && trouble_ != before) {
    log::Warn("the confirmed configuration is not kept: {}; the gateway keeps trying", *trouble_);
  } else if (written && *written) {
    log::Warn("the copies in {} were missing or changed, and were written again", folder());
  }
  return trouble_;
}

}  // namespace baudgate
