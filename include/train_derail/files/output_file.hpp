/// \file
/// Output files that appear complete or not at all, and that do not overwrite existing files unless this is asked for.
#pragma once

#include <atomic>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <stdexcept>
#include <string>

namespace train_derail::files {

/// What to do if the file to be written exists already.
enum class Existing {
  refuse,  ///< throw ExistsError
  replace  ///< put the new file in its place
};

/// Whether what is written is compressed by gzip, at the same bytes for the same text.
enum class Compression {
  by_name,  ///< if the name ends in ".gz"
  never     ///< for files that are read as they are
};

/// The file to be written exists already and is not to be replaced.
struct ExistsError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file that gets its name only when it is complete. Until commit() it has no name (O_TMPFILE), so nothing remains if
/// the process is killed. If the file system does not support that, the file is called `.train_derail-*.part` until
/// then, in the same folder; the destructor removes it, or after a kill the next OutputFile in that folder. Symbolic
/// links are followed: the file they point to is written.
///
/// Pipes, character devices (/dev/null, a terminal), /dev/stdout, /dev/stderr and /dev/fd/N are written at once;
/// commit() then only checks that everything was written. If nobody reads a pipe, opening it waits for one second.
///
/// All errors are std::runtime_error with the text "PATH: what is wrong".
class OutputFile {
 public:
  /// Opens the file, so that a path that cannot be written is reported before anything is computed.
  /// \param path      file to be written; `-` is standard output.
  /// \param existing  what to do if the file exists; with Existing::refuse ExistsError is thrown.
  /// \param stop      once it is set, writing to a pipe that nobody reads is given up after a second; may be null.
  /// \param compression  Compression::by_name throws for such a name if this build cannot compress.
  explicit OutputFile(std::string path, Existing existing = Existing::refuse, const std::atomic<bool>* stop = nullptr,
                      Compression compression = Compression::by_name);
  /// Removes what was written, unless commit() has returned.
  ~OutputFile();
  OutputFile(OutputFile&&) noexcept;
  OutputFile& operator=(OutputFile&&) noexcept;

  /// Buffered stream to write to. If writing fails, the stream goes bad, and check() and commit() give the reason.
  std::ostream& stream();
  /// Throws if something could not be written so far. A full disk is noticed in this way before the end.
  void check();
  /// Flushes the stream, syncs to the disk and gives the file its name. Throws ExistsError if another process has made
  /// a file of that name in the meantime.
  void commit();
  /// Present name of the file, for a library that opens files by name. The library must close it before commit();
  /// stream() must not be used then. Empty for pipes and devices.
  std::string name_so_far() const;

  /// Bytes that have been handed to the system so far, compressed if they are.
  std::uintmax_t size() const;
  /// Path that was given to the constructor.
  const std::string& path() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Writes `text` to a file in one call; throws as OutputFile does.
void write_file(const std::string& path, const std::string& text, Existing existing = Existing::refuse);

/// Renames the complete file `from` to `to`, which must lie in the same file system, and syncs the folder.
/// Throws ExistsError if `to` exists and must not be replaced (`from` then stays), or std::runtime_error.
void move_into_place(const std::string& from, const std::string& to, Existing existing);

/// Whether two paths mean the same file: links are followed, and the file need not exist. `-` is standard output.
bool same_file(const std::string& a, const std::string& b);

/// Flushes standard output. Throws std::runtime_error if not all of it could be written.
void check_standard_output();

}  // namespace train_derail::files
