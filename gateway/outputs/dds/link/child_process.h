// `ChildProcess` starts baudgate-dds as a child, passes it one socket of the link as descriptor 3,
// and waits until it has ended. BoundedLines turns the child's output into log lines.
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

// BoundedLines splits output into printable lines of limited length, at most kMost lines in
// kPeriod.
class BoundedLines {
 public:
  static constexpr std::size_t kLongest = 500;  ///< in bytes; the rest of a longer line is dropped
  static constexpr std::size_t kMost = 20;      ///< most lines per kPeriod; more are only counted
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
  /// Starts a child that inherits only the link and a pipe for its standard output and error. The
  /// child has a process group of its own, so Ctrl-C does not reach it. The calling thread must
  /// outlive the child, because the kernel terminates the child together with this thread.
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
  /// Waits until the child has ended, and kills it after `most`. Returns how it ended, e.g. "was
  /// ended by signal 6" or "ended with exit code 1".
  std::string Reap(Duration most);

 private:
  ChildProcess() = default;

  pid_t id_ = -1;
  Descriptor output_;
};

/// Returns the path of the program, from the folder of this process's binary or from the folder of
/// installed programs. The error contains both folders.
Result<std::string> FindProgram(const std::string& name);

}  // namespace baudgate::dds
