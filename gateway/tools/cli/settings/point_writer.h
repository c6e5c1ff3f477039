// Write this point, and tell what became of it: what `baudgate settings restore` needs of a running
// gateway. The writes take the same way as all others: permission, limits, queue, audit.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace baudgate::settings {

struct WriteReport {
  std::string end;     ///< WriteEnd as a word: "ok", "refused", …; "unknown" without an answer
  std::string reason;  ///< one sentence; empty when ok
  bool read_back = false;  ///< the device shows what was written

  bool done() const { return end == "ok"; }
};

class PointWriter {
 public:
  virtual ~PointWriter() = default;
  /// `point`: LINE.DEVICE.POINT; `value` in its unit.
  virtual WriteReport Write(const std::string& point, const std::string& value) = 0;
  /// Why that would be denied now, in one sentence; empty: it may be written. Writes nothing.
  virtual std::optional<std::string> WhyNot(const std::string& point, const std::string& value) = 0;
};

/// Through the control socket at `path`; empty: the gateway in the default places.
class SocketWriter final : public PointWriter {
 public:
  explicit SocketWriter(std::string path) : path_(std::move(path)) {}
  WriteReport Write(const std::string& point, const std::string& value) override;
  std::optional<std::string> WhyNot(const std::string& point, const std::string& value) override;

 private:
  std::string path_;
};

}  // namespace baudgate::settings
