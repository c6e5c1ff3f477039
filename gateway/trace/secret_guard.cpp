// SPDX-License-Identifier: Apache-2.0
#include "gateway/trace/secret_guard.h"

#include <algorithm>

namespace baudgate {
namespace {

/// More requests with secrets than this are not on their way at the same time.
constexpr std::size_t kMostSecrets = 4;
/// Two characters of a secret in their order are taken for a part of it.
constexpr std::size_t kShortestPart = 2;

/// More than one byte in so many has to be the same, and as many of those that are no secret: a
/// password of equal digits is like itself at any place. A lost byte cuts an echo into two shifted
/// pieces; in another exchange most bytes belong to another answer.
constexpr std::ptrdiff_t kOneInOwn = 3;
constexpr std::ptrdiff_t kOneInOther = 2;

/// Masks the places of secrets wherever `received` looks like the request, from whichever byte on:
/// damage elsewhere does not hide them.
void MaskRepeats(View request, const std::vector<bool>& secret, View received,
                 std::ptrdiff_t one_in, std::vector<bool>& mask) {
  const auto size = static_cast<std::ptrdiff_t>(request.size());
  const auto count = static_cast<std::ptrdiff_t>(received.size());
  for (std::ptrdiff_t shift = 1 - size; shift < count; ++shift) {
    const auto from = std::max<std::ptrdiff_t>(0, -shift);
    const auto to = std::min(size, count - shift);
    std::ptrdiff_t open = 0;
    std::ptrdiff_t open_alike = 0;
    std::ptrdiff_t alike = 0;
    for (std::ptrdiff_t i = from; i < to; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const bool same = request[at] == received[static_cast<std::size_t>(i + shift)];
      alike += same ? 1 : 0;
      if (secret[at]) continue;
      ++open;
      open_alike += same ? 1 : 0;
    }
    if (alike < 2 || one_in * alike <= to - from) continue;
    if (open_alike == 0 || one_in * open_alike < open) continue;
    for (std::ptrdiff_t i = from; i < to; ++i) {
      if (secret[static_cast<std::size_t>(i)]) mask[static_cast<std::size_t>(i + shift)] = true;
    }
  }
}

/// Masks every part of one secret that is long enough to be one.
void MaskParts(View secret, View received, std::vector<bool>& mask) {
  const std::size_t shortest = std::min(secret.size(), kShortestPart);
  for (std::size_t at = 0; at < received.size(); ++at) {
    for (std::size_t from = 0; from < secret.size(); ++from) {
      std::size_t length = 0;
      while (from + length < secret.size() && at + length < received.size() &&
             secret[from + length] == received[at + length]) {
        ++length;
      }
      if (length < shortest || length == 0) continue;
      std::fill_n(mask.begin() + static_cast<std::ptrdiff_t>(at), length, true);
    }
  }
}

/// The runs of secret bytes in the request.
void MaskParts(View request, const std::vector<bool>& secret, View received,
               std::vector<bool>& mask) {
  for (std::size_t begin = 0; begin < request.size(); ++begin) {
    if (!secret[begin]) continue;
    std::size_t end = begin;
    while (end < request.size() && secret[end]) ++end;
    MaskParts(request.subspan(begin, end - begin), received, mask);
    begin = end;
  }
}

}  // namespace

std::vector<bool> SecretGuard::MaskOf(const Request& request) {
  std::vector<bool> mask(request.bytes.size());
  for (const auto& [at, count] : request.expect.secrets) {
    for (std::size_t i = at; i - at < count && i < mask.size(); ++i) mask[i] = true;
  }
  return mask;
}

void SecretGuard::Forget(Instant now) {
  while (!secrets_.empty() && (secrets_.size() > kMostSecrets || now > secrets_.front().until)) {
    secrets_.pop_front();
  }
}

void SecretGuard::OnExchangeEnd(Instant now) {
  for (Secret& secret : secrets_) secret.until = std::min(secret.until, now + kLinger);
}

void SecretGuard::OnSent(const Request& request, Instant now) {
  OnExchangeEnd(now);  // of one that a lost port ended in silence
  newest_is_last_request_ = !request.expect.secrets.empty();
  if (newest_is_last_request_) {
    secrets_.push_back({request.bytes, MaskOf(request)});
    before_.clear();
  }
  Forget(now);
  if (secrets_.empty()) before_.clear();
}

bool SecretGuard::active(Instant now) const {
  return std::any_of(secrets_.begin(), secrets_.end(),
                     [now](const Secret& secret) { return now <= secret.until; });
}

std::vector<bool> SecretGuard::Mask(View received) {
  Bytes all = before_;
  Append(all, received);
  std::vector<bool> mask(all.size());
  std::size_t reach = 0;
  for (const Secret& secret : secrets_) {
    // What comes after the next request is another answer: two digits of a password in it are
    // chance.
    const bool own = newest_is_last_request_ && &secret == &secrets_.back();
    MaskRepeats(secret.request, secret.secret, all, own ? kOneInOwn : kOneInOther, mask);
    if (own) MaskParts(secret.request, secret.secret, all, mask);
    reach = std::max(reach, secret.request.size());
  }
  mask.erase(mask.begin(), mask.begin() + static_cast<std::ptrdiff_t>(before_.size()));
  if (all.size() > reach) all.erase(all.begin(), all.end() - static_cast<std::ptrdiff_t>(reach));
  before_ = std::move(all);
  return mask;
}

}  // namespace baudgate
