// A pseudo terminal that plays the far end of a serial cable, for twins, the demo and tests: what
// the twin writes into the master, a reader of the linked path receives. ServerOf finds the program
// that serves a pty.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/result.h"

namespace baudgate::tools {

// Which program serves the pty that a symbolic link leads to, so that no other takes the link of a
// running twin.
//
//   link -> /dev/pts/7, no /dev/pts/7                 nobody: its program has ended
//   link -> /dev/pts/7, which was made after the link nobody: the number has been given away again
//   link -> /dev/pts/7, which was made before         served

/// "socat (pid 4711)", "another program" where it may not be known; empty: it is not served.
/// `target`: what `link` says, "/dev/pts/7".
std::optional<std::string> ServerOf(const std::string& link, const std::string& target);

class Pty {
 public:
  /// A raw pair. With `link`, a symbolic link to the slave is put there, in the place of an older
  /// link whose pty nobody serves any more; anything else that stands there is left alone and an
  /// error.
  static Result<Pty> Create(const std::string& link = {});

  Pty(Pty&& other) noexcept;
  Pty& operator=(Pty&& other) noexcept;
  ~Pty() { Unplug(); }

  /// Non-blocking, close-on-exec; -1 after Unplug or TakeMaster. Stays the Pty's.
  int master() const { return master_; }
  /// The same, the caller's from now on (an asio stream_descriptor closes what it holds).
  int TakeMaster();
  /// "/dev/pts/7".
  const std::string& slave_path() const { return slave_path_; }
  /// Where to open it: the link, or the slave itself without one.
  const std::string& path() const { return link_.empty() ? slave_path_ : link_; }

  /// Pulls the cable: removes the link, if it is still ours, and closes both sides; whoever has the
  /// slave open is hung up. A master that was taken is the caller's to close.
  void Unplug();

 private:
  Pty() = default;
  Status OpenPair();
  Status MakeLink(const std::string& link);

  int master_ = -1;
  /// Held open so that a reader that closes does not hang up the twin.
  int slave_ = -1;
  std::string slave_path_;
  std::string link_;
};

}  // namespace baudgate::tools
