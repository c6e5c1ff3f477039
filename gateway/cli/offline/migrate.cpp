// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/offline/migrate.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "config/migration.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/cli/offline/check.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;

std::string Failure(const fs::path& file) { return file.string() + ": " + std::strerror(errno); }

/// A new file with the rights and the owner of another one.
Status WriteBeside(const fs::path& file, const std::string& text, const struct stat& like) {
  const int out = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (out < 0) return Error{Failure(file)};
  std::string_view rest = text;
  bool ok =
      ::fchown(out, like.st_uid, like.st_gid) == 0 && ::fchmod(out, like.st_mode & 07777) == 0;
  while (ok && !rest.empty()) {
    const auto written = ::write(out, rest.data(), rest.size());
    if (written > 0) rest.remove_prefix(static_cast<std::size_t>(written));
    ok = written >= 0 || errno == EINTR;
  }
  ok = ok && ::fsync(out) == 0;
  const Status status = ok ? Status() : Error{Failure(file)};
  ::close(out);
  if (!ok) ::unlink(file.c_str());
  return status;
}

/// The old one under a name of its own, then the new one in its place, whole.
Status Replace(const fs::path& path, const std::string& before, const std::string& text) {
  std::error_code error;
  const fs::path file = fs::canonical(path, error);  // what a link leads to
  struct stat found {};
  if (error || ::stat(file.c_str(), &found) != 0) return Error{Failure(path)};
  const fs::path backup = file.string() + ".bak";
  const fs::path part = file.string() + ".part";
  if (fs::exists(backup, error)) return Error{backup.string() + " is there already; move it away"};
  if (Status status = WriteBeside(backup, before, found); !status) return status;
  Status status = WriteBeside(part, text, found);
  if (status && ::rename(part.c_str(), file.c_str()) != 0) status = Error{Failure(file)};
  if (!status) {
    ::unlink(part.c_str());
    ::unlink(backup.c_str());
  }
  return status;
}

}  // namespace

int RunMigrate(const MigrateOptions& options, const config::Catalog& catalog, std::ostream& out,
               std::ostream& err) {
  const config::Migration migration = config::MigrateFile(options.file, options.protocol);
  if (!migration.problems.empty()) {
    PrintProblems(migration.problems, err);
    return migration.readable ? kExitBadConfiguration : kExitCanNot;
  }
  if (migration.kind == config::FileKind::profile) {
    const auto protocol = catalog.NeedProtocol(options.protocol);
    if (!protocol) {
      err << "baudgate: " << options.file << " is a profile; say of which protocol, --protocol NAME"
          << (options.protocol.empty() ? "" : ": " + protocol.error()) << '\n';
      return kExitUsage;
    }
  }
  const std::size_t changes = migration.changes.size();
  if (options.in_place && changes > 0) {
    if (const auto status = Replace(options.file, migration.before, migration.after); !status) {
      err << "baudgate: " << status.error() << "; nothing was changed\n";
      return kExitCanNot;
    }
  }
  for (const config::Renamed& one : migration.changes) {
    err << one.mark.ToString() << ": " << one.ToString() << '\n';
  }
  err << options.file << ": ";
  if (changes == 0) {
    err << "nothing to rewrite\n";
  } else if (options.in_place) {
    err << Plural(changes, "place") << " rewritten; as it was: " << options.file << ".bak\n";
  } else {
    err << Plural(changes, "place") << " to rewrite; --in-place does so\n";
  }
  if (!options.in_place) out << migration.after;
  return 0;
}

}  // namespace baudgate
