// Folds repeated log lines about clients.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/folded_log.h"

#include <spdlog/spdlog.h>

namespace baudgate::modbus {
namespace {

constexpr Duration kFoldFor = 60s;

constexpr std::string_view NameOf(FoldedLog::Kind kind) {
  switch (kind) {
    case FoldedLog::Kind::refused:
      return "refused";
    case FoldedLog::Kind::malformed:
      return "closed: malformed";
    case FoldedLog::Kind::stalled:
      return "closed: stalled";
    case FoldedLog::Kind::accept_failed:
      return "not accepted";
  }
  return "";
}

}  // namespace

void FoldedLog::Note(Kind kind, Instant now, std::string_view peer, std::string_view what) {
  Fold& fold = folds_[static_cast<std::size_t>(kind)];
  if (now < fold.until) {
    ++fold.repeats;
    return;
  }
  fold = {now + kFoldFor, 0};
  spdlog::warn("modbus: client {} {}: {}", peer, NameOf(kind), what);
}

void FoldedLog::Sweep(Instant now) {
  for (std::size_t i = 0; i < folds_.size(); ++i) {
    Fold& fold = folds_[i];
    if (fold.repeats == 0 || now < fold.until) continue;
    spdlog::warn("modbus: {} more clients {} in the last {}", fold.repeats,
                 NameOf(static_cast<Kind>(i)), FormatDuration(kFoldFor));
    fold = {now + kFoldFor, 0};
  }
}

}  // namespace baudgate::modbus
