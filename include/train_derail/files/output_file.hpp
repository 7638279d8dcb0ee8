// Files that are written whole or not at all, and over nothing that was there.
#pragma once

#include <atomic>
#include <iosfwd>
#include <memory>
#include <stdexcept>
#include <string>

namespace train_derail::files {

/// What happens to a file that lies where another is to be written.
enum class Existing { refuse, replace };

/// The target exists and is not to be replaced.
struct ExistsError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file that takes its name when it is whole: until commit() it has none (O_TMPFILE), so that a kill leaves nothing.
/// Where the file system cannot do that, it is `.train_derail-*.part` in the same folder: removed by the destructor,
/// after a kill by the next OutputFile in that folder. Links are followed: what they point to is written.
///
/// A pipe or a character device (/dev/null, a terminal), /dev/stdout, /dev/stderr and /dev/fd/N are written as it
/// comes; commit() then only says whether all went through. A pipe without a reader is waited for a second.
///
/// All errors are std::runtime_error, "PATH: what is wrong".
class OutputFile {
 public:
  /// Opens: an unwritable path is said before anything is computed. `-` is standard output. Throws ExistsError.
  /// Once `stop` is set, a pipe that is not read is waited for no longer than a second.
  explicit OutputFile(std::string path, Existing existing = Existing::refuse, const std::atomic<bool>* stop = nullptr);
  /// Nothing remains unless commit() has returned.
  ~OutputFile();
  OutputFile(OutputFile&&) noexcept;
  OutputFile& operator=(OutputFile&&) noexcept;

  /// Buffered. A failure shows in its state, and in commit() with the reason.
  std::ostream& stream();
  /// Throws if something written so far could not be: a full device is noticed before the end.
  void check();
  /// Flushes, syncs to the disk, and gives it its name. Throws ExistsError if somebody else has taken the name
  /// meanwhile.
  void commit();
  /// For a library that opens files by name: what it writes there, and has closed before commit(), is the file. Not
  /// together with stream(). Empty for what is written as it comes.
  std::string name_so_far() const;

  const std::string& path() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// All of a text that is at hand.
void write_file(const std::string& path, const std::string& text, Existing existing = Existing::refuse);

/// Gives the whole file `from` the name `to`, in the same file system, and syncs the folder.
/// Throws ExistsError, `from` then stays; std::runtime_error.
void move_into_place(const std::string& from, const std::string& to, Existing existing);

/// Whether two paths mean one file, also by links or when it does not exist yet. `-` is standard output.
bool same_file(const std::string& a, const std::string& b);

/// Flushes standard output. Throws std::runtime_error if not all of it could be written.
void check_standard_output();

}  // namespace train_derail::files
