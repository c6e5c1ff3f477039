// SPDX-License-Identifier: Apache-2.0
#include "gateway/process_start.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace baudgate {
namespace {

/// Does the work of process 1, and ends the process with the result of the child.
void BeInit(pid_t child, const sigset_t& all) {
  for (;;) {
    int caught = 0;
    if (::sigwait(&all, &caught) != 0) continue;
    if (caught != SIGCHLD) {
      ::kill(child, caught);
      continue;
    }
    int status = 0;
    for (pid_t ended; (ended = ::waitpid(-1, &status, WNOHANG)) > 0;) {
      if (ended != child) continue;
      ::_exit(WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
    }
  }
}

}  // namespace

void HoldStandardDescriptors() {
  int null = ::open("/dev/null", O_RDWR);
  while (null >= 0 && null <= STDERR_FILENO) null = ::open("/dev/null", O_RDWR);
  if (null >= 0) ::close(null);
}

void SplitFromInit() {
  if (::getpid() != 1) return;
  sigset_t all;
  sigset_t before;
  ::sigfillset(&all);
  ::sigprocmask(SIG_BLOCK, &all, &before);
  const pid_t child = ::fork();
  if (child > 0) BeInit(child, all);
  // The child continues here. If fork has failed, process 1 itself continues here.
  ::sigprocmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace baudgate
