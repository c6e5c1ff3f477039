// `ChildProcess` starts baudgate-dds and waits for its end; descriptor 3 is a socket of the link.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/link/packet_socket.h"

namespace baudgate::dds {

// Splits output into printable lines of limited length, at most kMost lines in kPeriod.
class BoundedLines {
 public:
  static constexpr std::size_t kLongest = 500;  ///< in bytes; the rest of a longer line is dropped
  static constexpr std::size_t kMost = 20;      ///< lines per kPeriod; further lines are counted
  static constexpr Duration kPeriod = 10s;

  std::vector<std::string> Add(std::string_view bytes, Instant now);

 private:
  void Finish(Instant now, std::vector<std::string>& lines);

  std::string line_;
  Instant period_end_{};
  std::size_t told_ = 0;
  std::size_t left_out_ = 0;
};

/// The number of the link's descriptor in the child process.
inline constexpr int kLinkDescriptor = 3;

class ChildProcess {
 public:
  /// The child inherits only the link and a pipe for its output, and has its own process group, so
  /// Ctrl-C does not reach it. The kernel terminates it together with the calling thread.
  static Result<ChildProcess> Start(const std::string& program,
                                    const std::vector<std::string>& arguments,
                                    const Descriptor& link);
  ~ChildProcess();  ///< kills a child that still runs
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  pid_t id() const { return id_; }
  /// Returns the pipe of the child's standard output and error; non-blocking.
  int output() const { return output_.get(); }
  void CloseOutput() { output_.Close(); }
  /// Kills the child after `most`. Returns how it ended, e.g. "was ended by signal 6".
  std::string Reap(Duration most);

 private:
  ChildProcess() = default;

  pid_t id_ = -1;
  Descriptor output_;
};

/// Searches the folder of this process's binary, then that of installed programs.
Result<std::string> FindProgram(const std::string& name);

}  // namespace baudgate::dds
