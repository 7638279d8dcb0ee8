// A folder of results: which journals lie in it, and who may write them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "train_derail/study/journal.hpp"

namespace train_derail::study {

/// Path of a file in a folder.
std::string in(const std::string& folder, const std::string& name);

std::string journal_name(const Shard& shard);
/// Of a name as journal_name() makes it; count 0: of no journal.
Shard shard_of(const std::filesystem::path& path);
/// In the order of their names.
std::vector<std::filesystem::path> journals_in(const std::string& folder);

/// Throw std::runtime_error, "PATH: what is wrong"; the second says what the system says.
[[noreturn]] void fail(const std::string& path, const std::string& problem);
[[noreturn]] void fail_errno(const std::string& path);

/// Locks of ranges of study.json: the shards', and beyond them that of whatever is put together from the journals. They
/// belong to an open file, end with it, and work over a network. The journals themselves can then be replaced.
class Lock {
 public:
  explicit Lock(int file) : file_(file) {}
  /// Opens study.json of a folder. Throws std::runtime_error.
  static int open(const std::string& folder);
  /// False if another process has it.
  bool try_shard(const Shard& shard) const;
  bool try_all_shards() const;
  void wait_for_tables() const;
  void release_shard(const Shard& shard) const;

 private:
  bool set(int command, short type, std::int64_t from, std::int64_t length) const;
  int file_;
};

/// Closed at the end of its life, and with it what is locked by it.
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
