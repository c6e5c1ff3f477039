// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/certificates.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "gateway/base/guarded.h"
#include "gateway/base/log.h"
#include "gateway/outputs/pki/security_check.h"
#include "transports/tls_files.h"

namespace baudgate::daemon {
namespace {

/// The certificates of one use, as they were read last.
struct Found {
  status::CertificateEnd end;
  std::string file;     ///< file with the certificate that ends first
  std::string trouble;  ///< why the files cannot be used; empty: they can
  std::string kind;     ///< the word behind `baudgate certs` that renews the files
};

constexpr const char* kWeb = "web";
constexpr const char* kDds = "dds";

Found Look(const config::TlsUse& use) {
  const auto texts = tls::ReadTls(use.files);
  if (!texts) return {{use.where, {}}, {}, use.where + ": " + texts.error(), use.kind};
  return {{use.where, texts->until}, texts->ends_first, {}, use.kind};
}

bool EndsSoon(const Found& found, WallTime now) {
  return !tls::EndsSoon({.until = found.end.until, .ends_first = found.file}, now).empty();
}

std::string Sentence(const Found& found, WallTime now) {
  if (!found.trouble.empty()) return found.trouble;
  if (!EndsSoon(found, now)) return {};
  return fmt::format(
      "The certificate of {} in {} {} on {}. Renew it: baudgate certs {} DIR, or ask its "
      "authority{}",
      found.end.use, found.file, found.end.until <= now ? "has ended" : "ends",
      FormatWallTime(found.end.until).substr(0, 10), found.kind,
      found.kind == kWeb   ? "; then run: baudgate reload"
      : found.kind == kDds ? "; then restart the gateway"
                           : "");
}

}  // namespace

struct Certificates::State {
  struct Wanted {
    std::vector<config::TlsUse> uses;
    config::DdsSecurity dds{};  // without an identity: none
  };

  void Round() {
    Wanted its;
    std::uint64_t number = 0;
    {
      const MutexLock lock(mutex);
      its = wanted;
      number = applied;
    }
    if (number == 0) return;
    std::vector<Found> all;
    for (const config::TlsUse& use : its.uses) all.push_back(Look(use));
    if (!its.dds.identity.empty()) {
      // DDS itself reports files that it cannot use.
      const auto report = pki::CheckSecurity(its.dds, ReadClocks().wall);
      if (report.valid_until != WallTime{}) {
        all.push_back({{kDds, report.valid_until}, its.dds.identity, {}, kDds});
      }
    }
    const MutexLock lock(mutex);
    if (number != applied) return;  // Apply has requested another round
    KeepUsed(all, number != looked);
    found = std::move(all);
    looked = number;
    ++rounds;
  }

  /// The web server uses a renewed certificate only after a reload, DDS only after a restart, so
  /// the end of the certificate in use counts for them.
  void KeepUsed(std::vector<Found>& all, bool reloaded) BAUDGATE_REQUIRES(mutex) {
    for (Found& one : all) {
      const bool again = one.end.use == kDds || (one.end.use == kWeb && !reloaded);
      const auto before =
          std::ranges::find(found, one.end.use, [](const Found& other) { return other.end.use; });
      if (!again || before == found.end() || before->file != one.file) continue;
      if (before->trouble.empty() && one.trouble.empty()) one.end.until = before->end.until;
    }
  }

  mutable Mutex mutex;
  Wanted wanted BAUDGATE_GUARDED_BY(mutex);
  std::uint64_t applied BAUDGATE_GUARDED_BY(mutex) = 0;  // calls of Apply
  std::uint64_t looked BAUDGATE_GUARDED_BY(mutex) = 0;   // value of `applied` for `found`
  std::uint64_t rounds BAUDGATE_GUARDED_BY(mutex) = 0;
  std::vector<Found> found BAUDGATE_GUARDED_BY(mutex);
};

Certificates::Certificates()
    : state_(std::make_shared<State>()), worker_("certificates", [state = state_](bool last) {
        if (!last) state->Round();
        return kWhenWoken;
      }) {
  worker_.Start();
}

Certificates::~Certificates() { worker_.Leave(); }

void Certificates::Apply(const config::Config& config) {
  State::Wanted wanted{config::TlsUses(config)};
  if (config.dds.enabled) wanted.dds = config.dds.security;
  {
    const MutexLock lock(state_->mutex);
    state_->wanted = std::move(wanted);
    ++state_->applied;
  }
  worker_.Wake();
}

void Certificates::Tick(Now now) {
  if (asked_ == Instant::min()) asked_ = now.instant;
  if (now.instant - asked_ >= kEvery) {
    asked_ = now.instant;
    worker_.Wake();
  }
  const std::vector<std::string> all = Sentences(now.wall);
  const std::set<std::string> present(all.begin(), all.end());
  for (const std::string& sentence : present) {
    if (!told_.contains(sentence)) log::Warn("{}", sentence);
  }
  told_ = present;
}

std::vector<status::CertificateEnd> Certificates::ends() const {
  std::vector<status::CertificateEnd> ends;
  const MutexLock lock(state_->mutex);
  for (const Found& one : state_->found) {
    if (one.trouble.empty()) ends.push_back(one.end);
  }
  return ends;
}

std::vector<std::string> Certificates::Sentences(WallTime now) const {
  std::vector<std::string> sentences;
  const MutexLock lock(state_->mutex);
  for (const Found& one : state_->found) {
    if (std::string sentence = Sentence(one, now); !sentence.empty()) {
      sentences.push_back(std::move(sentence));
    }
  }
  return sentences;
}

std::optional<std::string> Certificates::Alarm(WallTime now) const {
  const MutexLock lock(state_->mutex);
  if (state_->rounds == 0) return std::nullopt;
  const Found* first = nullptr;
  for (const Found& one : state_->found) {
    if (!one.trouble.empty() || !EndsSoon(one, now)) continue;
    if (first == nullptr || one.end.until < first->end.until) first = &one;
  }
  return first == nullptr ? std::string() : Sentence(*first, now);
}

}  // namespace baudgate::daemon
