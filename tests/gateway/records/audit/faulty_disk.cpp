// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/records/audit/faulty_disk.h"

#include <sqlite3.h>

#include <algorithm>
#include <cstring>

namespace baudgate::audit {
namespace {

using File = FaultyDisk::File;

struct Handle {
  sqlite3_file base;
  FaultyDisk* disk;
  std::shared_ptr<File>* file;
};

Handle& Of(sqlite3_file* file) { return *reinterpret_cast<Handle*>(file); }
File& FileOf(sqlite3_file* file) { return **Of(file).file; }

void Apply(std::vector<char>& content, const FaultyDisk::Change& change, std::size_t bytes) {
  if (change.truncate) {
    content.resize(std::min(content.size(), change.offset));
    return;
  }
  content.resize(std::max(content.size(), change.offset + bytes));
  std::copy_n(change.bytes.begin(), bytes,
              content.begin() + static_cast<std::ptrdiff_t>(change.offset));
}

int Close(sqlite3_file* file) {
  --FileOf(file).handles;
  delete Of(file).file;
  return SQLITE_OK;
}

int Read(sqlite3_file* file, void* to, int count, sqlite3_int64 offset) {
  const auto& content = FileOf(file).now;
  const auto from = std::min(static_cast<std::size_t>(offset), content.size());
  const auto there = std::min(static_cast<std::size_t>(count), content.size() - from);
  std::memset(to, 0, static_cast<std::size_t>(count));
  if (there > 0) std::memcpy(to, content.data() + from, there);
  return there == static_cast<std::size_t>(count) ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
}

int Change(sqlite3_file* file, FaultyDisk::Change change) {
  FaultyDisk& disk = *Of(file).disk;
  if (disk.write_error != 0) return disk.write_error;
  if (!disk.Spend()) return SQLITE_IOERR_WRITE;
  Apply(FileOf(file).now, change, change.bytes.size());
  FileOf(file).pending.push_back(std::move(change));
  return SQLITE_OK;
}

int Write(sqlite3_file* file, const void* from, int count, sqlite3_int64 offset) {
  const char* bytes = static_cast<const char*>(from);
  return Change(file, {static_cast<std::size_t>(offset), {bytes, bytes + count}});
}

int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  return Change(file, {static_cast<std::size_t>(size), {}, true});
}

int Sync(sqlite3_file* file, int) {
  FaultyDisk& disk = *Of(file).disk;
  disk.WaitWhileHanging();
  if (disk.sync_error != 0) return disk.sync_error;
  if (!disk.Spend()) return SQLITE_IOERR_FSYNC;
  FileOf(file).synced = FileOf(file).now;
  FileOf(file).pending.clear();
  return SQLITE_OK;
}

int FileSize(sqlite3_file* file, sqlite3_int64* size) {
  *size = static_cast<sqlite3_int64>(FileOf(file).now.size());
  return SQLITE_OK;
}

/// Refuses an exclusive lock while another connection is open. SQLite locks exclusively to remove
/// its log, which only the last connection may do.
int Lock(sqlite3_file* file, int level) {
  return level == SQLITE_LOCK_EXCLUSIVE && FileOf(file).handles > 1 ? SQLITE_BUSY : SQLITE_OK;
}
int Unlock(sqlite3_file*, int) { return SQLITE_OK; }
int IsReserved(sqlite3_file*, int* reserved) {
  *reserved = 0;
  return SQLITE_OK;
}
int Control(sqlite3_file*, int, void*) { return SQLITE_NOTFOUND; }
int SectorSize(sqlite3_file*) { return 512; }
int Characteristics(sqlite3_file*) { return 0; }

int ShmMap(sqlite3_file* file, int region, int size, int extend, volatile void** at) {
  auto& shared = FileOf(file).shared;
  const auto index = static_cast<std::size_t>(region);
  *at = nullptr;
  if (shared.size() <= index && extend == 0) return SQLITE_OK;
  while (shared.size() <= index) {
    shared.push_back(std::make_unique<std::vector<char>>(static_cast<std::size_t>(size)));
  }
  *at = shared[index]->data();
  return SQLITE_OK;
}
int ShmLock(sqlite3_file*, int, int, int) { return SQLITE_OK; }
void ShmBarrier(sqlite3_file*) {}
int ShmUnmap(sqlite3_file* file, int drop) {
  if (drop != 0 && FileOf(file).handles == 1) FileOf(file).shared.clear();
  return SQLITE_OK;
}

constexpr sqlite3_io_methods kMethods = {
    2,        Close,      Read,    Write,      Truncate,        Sync,   FileSize, Lock,
    Unlock,   IsReserved, Control, SectorSize, Characteristics, ShmMap, ShmLock,  ShmBarrier,
    ShmUnmap, nullptr,    nullptr};

FaultyDisk& DiskOf(sqlite3_vfs* vfs) { return *static_cast<FaultyDisk*>(vfs->pAppData); }

int Open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  FaultyDisk& disk = DiskOf(vfs);
  file->pMethods = nullptr;
  if (disk.open_error != 0) return disk.open_error;
  if (disk.power_failed()) return SQLITE_IOERR;
  const std::string path = name != nullptr ? name : "";
  auto& entry = disk.files[path];
  if (!entry && (flags & SQLITE_OPEN_CREATE) == 0) {
    disk.files.erase(path);
    return SQLITE_CANTOPEN;
  }
  if (!entry) entry = std::make_shared<File>();
  ++entry->handles;
  Of(file).disk = &disk;
  Of(file).file = new std::shared_ptr<File>(entry);
  file->pMethods = &kMethods;
  if (out_flags != nullptr) *out_flags = flags;
  return SQLITE_OK;
}

int Delete(sqlite3_vfs* vfs, const char* name, int) {
  FaultyDisk& disk = DiskOf(vfs);
  if (disk.files.count(name) == 0) return SQLITE_IOERR_DELETE_NOENT;
  if (!disk.Spend()) return SQLITE_IOERR_DELETE;
  disk.files.erase(name);
  return SQLITE_OK;
}

int Access(sqlite3_vfs* vfs, const char* name, int, int* result) {
  *result = DiskOf(vfs).files.count(name) != 0 ? 1 : 0;
  return SQLITE_OK;
}

int FullPath(sqlite3_vfs*, const char* name, int size, char* out) {
  sqlite3_snprintf(size, out, "%s", name);
  return SQLITE_OK;
}

int Randomness(sqlite3_vfs*, int count, char* out) {
  static std::mt19937 random(1);
  for (int i = 0; i < count; ++i) out[i] = static_cast<char>(random());
  return count;
}
int Sleep(sqlite3_vfs*, int microseconds) { return microseconds; }
int Today(sqlite3_vfs*, double* day) {
  *day = 2461368.5;
  return SQLITE_OK;
}
int LastError(sqlite3_vfs*, int, char*) { return 0; }

std::string NextName() {
  static int count = 0;
  return "faulty-" + std::to_string(++count);
}

}  // namespace

struct FaultyDisk::Vfs {
  sqlite3_vfs base{};
};

FaultyDisk::FaultyDisk() : name_(NextName()), vfs_(std::make_unique<Vfs>()) {
  sqlite3_initialize();
  sqlite3_vfs& vfs = vfs_->base;
  vfs.iVersion = 1;
  vfs.szOsFile = sizeof(Handle);
  vfs.mxPathname = 512;
  vfs.zName = name_.c_str();
  vfs.pAppData = this;
  vfs.xOpen = Open;
  vfs.xDelete = Delete;
  vfs.xAccess = Access;
  vfs.xFullPathname = FullPath;
  vfs.xRandomness = Randomness;
  vfs.xSleep = Sleep;
  vfs.xCurrentTime = Today;
  vfs.xGetLastError = LastError;
  sqlite3_vfs_register(&vfs, 0);
}

FaultyDisk::~FaultyDisk() { sqlite3_vfs_unregister(&vfs_->base); }

bool FaultyDisk::Spend() {
  if (power_left == 0) return false;
  if (power_left > 0) --power_left;
  return power_left != 0;
}

void FaultyDisk::Restore(std::mt19937& random) {
  for (auto& [name, file] : files) {
    std::vector<char> content = file->synced;
    for (const FaultyDisk::Change& change : file->pending) {
      const auto fate = random() % 3;
      if (fate == 0) continue;
      const std::size_t all = change.bytes.size();
      Apply(content, change, fate == 1 || all == 0 ? all : random() % all);
    }
    const auto whole = std::make_shared<File>();
    whole->now = whole->synced = std::move(content);
    file = whole;
  }
  power_left = -1;
}

void FaultyDisk::Hang(bool hang) {
  const std::lock_guard lock(mutex_);
  hangs_ = hang;
  changed_.notify_all();
}

void FaultyDisk::WaitWhileHanging() {
  std::unique_lock lock(mutex_);
  waits_ = hangs_;
  changed_.notify_all();
  changed_.wait(lock, [this] { return !hangs_; });
  waits_ = false;
}

void FaultyDisk::WaitUntilItHangs() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waits_; });
}

}  // namespace baudgate::audit
