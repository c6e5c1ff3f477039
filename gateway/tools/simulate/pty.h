// `Pty` is a pseudo terminal that replaces a serial cable, for simulated devices, the demo and
// tests: bytes that a simulated device writes to the master arrive at the program that reads the
// linked path.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/result.h"

namespace baudgate::tools {

// `ServerOf` finds the program that serves the pty of a symbolic link, so that a second simulator
// does not take over the link of a running simulated device.
//
//   link -> /dev/pts/7, no /dev/pts/7                           not served: its program has ended
//   link -> /dev/pts/7, which was created after the link        not served: the number was reused
//   link -> /dev/pts/7, which was created before the link       served

/// Returns the program, such as "socat (pid 4711)", or "another program" if it cannot be
/// determined; empty: no program serves the pty. `target`: the target of `link`, "/dev/pts/7".
std::optional<std::string> ServerOf(const std::string& link, const std::string& target);

class Pty {
 public:
  /// Creates a pty in raw mode. With `link`, also makes a symbolic link to its slave. An older link
  /// whose pty is not served any more is replaced; any other file at this path is an error.
  static Result<Pty> Create(const std::string& link = {});

  Pty(Pty&& other) noexcept;
  Pty& operator=(Pty&& other) noexcept;
  ~Pty() { Unplug(); }

  /// Returns the master (non-blocking, close-on-exec), which this Pty closes; -1 after Unplug or
  /// TakeMaster.
  int master() const { return master_; }
  /// Passes the ownership of the master to the caller.
  int TakeMaster();
  const std::string& slave_path() const { return slave_path_; }
  /// Returns the path that a reader opens: the link, or the slave's path if there is no link.
  const std::string& path() const { return link_.empty() ? slave_path_ : link_; }

  /// Removes the link, if it still points to this pty, and closes both sides. Programs that have
  /// the slave open get a hang-up. A master from TakeMaster stays open.
  void Unplug();

 private:
  Pty() = default;
  Status OpenPair();
  Status MakeLink(const std::string& link);

  int master_ = -1;
  /// The slave stays open here, so that the simulated device gets no hang-up when a reader closes
  /// it.
  int slave_ = -1;
  std::string slave_path_;
  std::string link_;
};

}  // namespace baudgate::tools
