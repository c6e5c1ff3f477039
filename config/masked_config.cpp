// SPDX-License-Identifier: Apache-2.0
#include "config/masked_config.h"

#include <yaml-cpp/yaml.h>

#include <string_view>
#include <vector>

#include "config/yaml/yaml_source.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr const char* kMask = "***";
constexpr int kDeepest = 64;
constexpr std::size_t kMostText = 8 * 1024 * 1024;
/// A shorter value is hidden behind its own key only: "1" stands everywhere.
constexpr std::size_t kShortestCopy = 3;

class Masker {
 public:
  explicit Masker(const std::set<std::string>& secrets)
      : secrets_(secrets), names_(secrets.begin(), secrets.end()) {}

  /// False: it has no end.
  bool Collect(const YAML::Node& node, bool secret, int depth = 0) {
    if (depth > kDeepest || ++seen_ > kMostText) return false;
    if (node.IsScalar() && secret && node.Scalar().size() >= kShortestCopy) {
      values_.insert(node.Scalar());
    }
    for (const auto& item : node) {
      const bool in_map = item.first.IsDefined();
      const YAML::Node& child = in_map ? item.second : item;
      const bool hidden = secret || (in_map && IsSecret(item.first));
      if (!Collect(child, hidden, depth + 1)) return false;
    }
    return true;
  }

  void Emit(const YAML::Node& node, YAML::Emitter& out) const {
    if (node.IsMap()) {
      EmitMap(node, out);
    } else if (node.IsSequence()) {
      out << YAML::BeginSeq;
      for (const auto& item : node) Emit(item, out);
      out << YAML::EndSeq;
    } else if (node.IsScalar()) {
      out << Shown(node.Scalar());
    } else {
      out << YAML::Null;
    }
  }

 private:
  /// In "{ password: SEC,RET }" the end is a key without a value.
  void EmitMap(const YAML::Node& node, YAML::Emitter& out) const {
    bool behind_secret = false;
    out << YAML::BeginMap;
    for (const auto& entry : node) {
      const bool secret = IsSecret(entry.first);
      const bool rest = behind_secret && entry.second.IsNull();
      out << YAML::Key;
      if (rest || !entry.first.IsScalar()) {
        out << kMask;
      } else {
        out << Shown(entry.first.Scalar());
      }
      out << YAML::Value;
      if (secret) {
        out << kMask;
      } else {
        Emit(entry.second, out);
      }
      behind_secret = secret || rest;
    }
    out << YAML::EndMap;
  }

  bool IsSecret(const YAML::Node& key) const {
    if (!key.IsScalar()) return true;  // nobody knows what that is
    return secrets_.contains(key.Scalar()) || !Nearest(key.Scalar(), names_).empty();
  }

  /// "password:SECRET", where the blank is missing, is one word, and so is "pasword=SECRET".
  std::string Shown(const std::string& text) const {
    if (values_.contains(text)) return kMask;
    const std::string head = text.substr(0, text.find_first_of(":= \t"));
    if (head.size() < text.size() && !Nearest(head, names_).empty()) return head + kMask;
    const std::string lower = Lower(text);
    for (const std::string& secret : secrets_) {
      const auto at = lower.find(secret);
      if (at != std::string::npos && text.size() > at + secret.size()) {
        return text.substr(0, at + secret.size()) + kMask;
      }
    }
    return text;
  }

  const std::set<std::string>& secrets_;
  const std::vector<std::string_view> names_;
  std::set<std::string> values_;  // of secrets
  std::size_t seen_ = 0;
};

}  // namespace

std::set<std::string> SecretKeys(const Catalog& catalog) {
  std::set<std::string> keys;
  for (const auto& [name, protocol] : catalog.protocols) {
    for (const OptionSpec& spec : protocol->options) {
      if (spec.secret) keys.emplace(spec.name);
    }
  }
  return keys;
}

Result<std::string> MaskedConfig(const std::string& yaml, const std::set<std::string>& secrets) {
  Problems problems;
  const auto root = ParseYaml("configuration", yaml, problems);
  if (!root) return Error{"it is no YAML that can be read, so that its secrets are not known"};
  Masker masker(secrets);
  if (!masker.Collect(root->yaml(), false)) return Error{"it has no end: an alias names itself"};
  YAML::Emitter out;
  masker.Emit(root->yaml(), out);
  return std::string(out.c_str()) + "\n";
}

}  // namespace baudgate::config
