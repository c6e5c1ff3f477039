// SPDX-License-Identifier: Apache-2.0
#include "config/checks/uniques.h"

#include <filesystem>
#include <string_view>

#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

constexpr std::size_t kLongestName = 64;

bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsLetterOrDigit(char c) {
  return IsDigit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool IsWellFormed(std::string_view name, std::string_view separators) {
  bool after_word = false;
  for (const char c : name) {
    const bool separator = separators.find(c) != std::string_view::npos;
    if (separator ? !after_word : !IsLetterOrDigit(c)) return false;
    after_word = !separator;
  }
  return after_word;
}

Status CheckLength(std::string_view name) {
  if (name.size() <= kLongestName) return {};
  return Error{Quoted(name) + " is too long; at most 64 characters"};
}

}  // namespace

Status CheckName(std::string_view name) {
  if (IsWellFormed(name, "_-")) return CheckLength(name);
  return Error{Quoted(name) +
               " is not a valid name; use letters, digits and single '-' or '_' between them"};
}

Status CheckPointName(std::string_view name) {
  const std::string_view rest = name.substr(name.starts_with('_') ? 1 : 0);
  if (IsWellFormed(rest, "_") && !IsDigit(name.front())) return CheckLength(name);
  return Error{Quoted(name) +
               " is not a valid point name; use letters, digits and single '_' before or between "
               "them, no digit first"};
}

namespace {

/// Returns the same text for all spellings of one port.
std::string RealPort(const std::string& port) {
  if (IsNetworkPort(port)) {
    const auto at = ParseHostPort(port.substr(kTcpScheme.size()));
    if (!at) return port;
    const std::string host = IsIpAddress(at->host) ? Canonical(at->host) : Lower(at->host);
    return std::string(kTcpScheme) + host + ":" + std::to_string(at->port);
  }
  std::error_code error;
  const auto canonical = std::filesystem::weakly_canonical(port, error);
  return error ? port : canonical.string();
}

}  // namespace

const Uniques::Owner* Uniques::Claim(Owners& owners, const std::string& what,
                                     const std::string& name, const Mark& mark) {
  const auto [owner, is_new] = owners.emplace(what, Owner{name, mark});
  return is_new ? nullptr : &owner->second;
}

void Uniques::Line(const std::string& name, const Mark& mark) {
  if (const Owner* first = Claim(lines_, name, name, mark)) {
    problems_.Error(mark, "line name '" + name + "' is already used in line " +
                              std::to_string(first->mark.line) +
                              " of the file; choose another name");
  }
}

void Uniques::Device(const std::string& name, const Mark& mark) {
  if (const Owner* first = Claim(devices_, name, name, mark)) {
    problems_.Error(mark, "device name '" + name + "' is already used in line " +
                              std::to_string(first->mark.line) +
                              " of the file; choose another name");
  }
}

void Uniques::Unit(std::uint8_t unit, const std::string& device, const Mark& mark) {
  if (const Owner* first = Claim(units_, std::to_string(unit), device, mark)) {
    problems_.Error(mark, "unit: " + std::to_string(unit) + " is already used by device '" +
                              first->name + "' (line " + std::to_string(first->mark.line) +
                              "); choose another unit id");
  }
}

void Uniques::Port(const std::string& port, const std::string& line, bool shared,
                   const Mark& mark) {
  const auto [owner, is_new] =
      ports_.emplace(RealPort(port), Owner{"line '" + line + "'", mark, shared});
  const Owner& first = owner->second;
  if (is_new || (first.shared && shared)) return;
  problems_.Error(mark, "port: " + Quoted(port) + " is already the port of " + first.name +
                            "; put the devices on one line");
}

void Uniques::ListenerPort(const std::string& path, const Mark& mark) {
  if (const Owner* first = Claim(ports_, RealPort(path), "another listener", mark)) {
    problems_.Error(mark, "listen: " + Quoted(path) + " is already the port of " + first->name +
                              " (line " + std::to_string(first->mark.line) +
                              "); give each master its own port");
  }
}

void Uniques::Address(const std::string& what, const HostPort& at, const Mark& mark) {
  const Network reach = ReachOf(at.host);
  const std::string place = HostAndPort(at.host, at.port);
  for (const Taken& first : addresses_) {
    const Network other = ReachOf(first.at.host);
    if (first.at.port != at.port || !(Covers(other, reach) || Covers(reach, other))) continue;
    const std::string line = " in line " + std::to_string(first.mark.line);
    problems_.Error(
        mark, what + ": " + place +
                  (first.at == at
                       ? " occurs twice; first" + line
                       : " and " + HostAndPort(first.at.host, first.at.port) + line +
                             " use the same port; remove one of them, or give it another port"));
    return;
  }
  addresses_.push_back({at, mark});
}

}  // namespace baudgate::config
