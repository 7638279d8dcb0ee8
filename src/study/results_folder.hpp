/// \file
/// A results folder: which journals are in it, and which process may write them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "train_derail/study/journal.hpp"

namespace train_derail::study {

/// Returns the path of a file in a folder.
std::string in(const std::string& folder, const std::string& name);

std::string journal_name(const Shard& shard);
/// Returns the shard that a journal belongs to by its name; its count is 0 if the file is not a journal.
Shard shard_of(const std::filesystem::path& path);
/// Returns the journals in a folder, in the order of their names.
std::vector<std::filesystem::path> journals_in(const std::string& folder);

/// Throw std::runtime_error with the text "PATH: problem"; for the second the problem is that of errno.
[[noreturn]] void fail(const std::string& path, const std::string& problem);
[[noreturn]] void fail_errno(const std::string& path);

/// Locks on ranges of bytes of study.json: one for each shard, and one for writing tables. The locks belong to the open
/// file, end when it is closed, and work over a network. Since they are not on the journals, these can be replaced.
class Lock {
 public:
  explicit Lock(int file) : file_(file) {}
  /// Opens study.json of a folder for locking. Throws std::runtime_error.
  static int open(const std::string& folder);
  /// Locks one shard; returns false if another process has locked it.
  bool try_shard(const Shard& shard) const;
  bool try_all_shards() const;
  void wait_for_tables() const;
  void release_shard(const Shard& shard) const;

 private:
  bool set(int command, short type, std::int64_t from, std::int64_t length) const;
  int file_;
};

/// A Lock that opens study.json itself, and closes it at the end of its life.
struct HeldLock : Lock {
  explicit HeldLock(const std::string& folder) : HeldLock(Lock::open(folder)) {}
  ~HeldLock();
  HeldLock(const HeldLock&) = delete;
  HeldLock& operator=(const HeldLock&) = delete;
  const int file;

 private:
  explicit HeldLock(int f) : Lock(f), file(f) {}
};

}  // namespace train_derail::study
