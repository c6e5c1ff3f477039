// `Pty` is a pseudo terminal that acts as the far end of a serial cable, for twins, the demo and
// tests: bytes that a twin writes to the master arrive at a reader of the linked path.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/result.h"

namespace baudgate::tools {

// `ServerOf` finds the program that serves the pty of a symbolic link, so that a second simulator
// does not take the link of a running twin.
//
//   link -> /dev/pts/7, no /dev/pts/7                           not served: its program has ended
//   link -> /dev/pts/7, which was created after the link        not served: the number was reused
//   link -> /dev/pts/7, which was created before the link       served

/// Returns "socat (pid 4711)", or "another program" if it cannot be read; empty: not served.
/// `target`: the target of `link`, "/dev/pts/7".
std::optional<std::string> ServerOf(const std::string& link, const std::string& target);

class Pty {
 public:
  /// Creates a raw pair. With `link`, also a symbolic link to the slave, in place of an older link
  /// whose pty is not served any more; anything else at this path is left alone, and is an error.
  static Result<Pty> Create(const std::string& link = {});

  Pty(Pty&& other) noexcept;
  Pty& operator=(Pty&& other) noexcept;
  ~Pty() { Unplug(); }

  /// Returns the master (non-blocking, close-on-exec); -1 after Unplug or TakeMaster. The Pty owns
  /// it.
  int master() const { return master_; }
  /// Passes ownership of the master to the caller (an asio stream_descriptor closes it).
  int TakeMaster();
  /// Returns "/dev/pts/7".
  const std::string& slave_path() const { return slave_path_; }
  /// Returns the path that a reader opens: the link, or the slave if there is no link.
  const std::string& path() const { return link_.empty() ? slave_path_ : link_; }

  /// Pulls the cable: removes the link, if it still points to this pty, and closes both sides.
  /// Programs with an open slave get a hang-up. A master from TakeMaster stays open.
  void Unplug();

 private:
  Pty() = default;
  Status OpenPair();
  Status MakeLink(const std::string& link);

  int master_ = -1;
  /// The slave stays open here, so that a reader that closes it does not hang up the twin.
  int slave_ = -1;
  std::string slave_path_;
  std::string link_;
};

}  // namespace baudgate::tools
