// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/causes/words.h"

#include <algorithm>
#include <cctype>

namespace baudgate::diagnosis {
namespace {

constexpr std::size_t kLongestQuoted = 18;
constexpr std::size_t kQuoted = 12;
/// A reason that is longer than this is cut at a colon or comma.
constexpr std::size_t kLongest = 70;
/// Length of an escape sequence such as "\x00".
constexpr std::size_t kEscape = 4;

}  // namespace

std::string Shortened(const std::string& reason) {
  std::string text = reason.substr(0, reason.find("; "));
  if (text.size() > kLongest) {
    const std::size_t part =
        std::min({text.find(". ", kQuoted), text.find(": ", kQuoted), text.rfind(", ", kLongest)});
    if (part != std::string::npos && part > kQuoted) text.resize(part);
  }
  const std::size_t begin = text.find('\'');
  const std::size_t end = text.rfind('\'');
  if (begin == std::string::npos || end - begin <= kLongestQuoted + 1) return text;
  std::size_t cut = begin + 1 + kQuoted;
  // The quotation is not cut inside an escape sequence.
  const std::size_t escape = text.rfind('\\', cut - 1);
  if (escape != std::string::npos && escape > begin && cut - escape < kEscape) cut = escape;
  return text.replace(cut, end - cut, "...");
}

std::string Brief(const Finding& finding) { return Shortened(finding.cause); }

std::string RemedyOf(const Finding& finding) {
  if (!finding.remedy.empty()) return finding.remedy;
  return finding.outcome == Outcome::busy
             ? "poll it less often (poll)"
             : "check that the profile fits the device and its options";
}

std::string WithRemedy(const Finding& finding) {
  return finding.remedy.empty() ? finding.cause : Brief(finding) + NextSentence(finding.remedy);
}

std::string NextSentence(std::string text) {
  if (!text.empty()) {
    text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  }
  return ". " + text;
}

bool DoubtsProfile(const std::string& remedy) {
  return remedy.starts_with("check that the profile") ||
         remedy.starts_with("check whether the profile");
}

}  // namespace baudgate::diagnosis
