#include "train_derail/files/output_file.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <random>
#include <streambuf>
#include <thread>
#include <utility>

#ifdef TRAIN_DERAIL_GZIP
#include <boost/iostreams/filter/gzip.hpp>
#include <boost/iostreams/filtering_stream.hpp>
#endif
#include <fmt/format.h>

namespace train_derail::files {

namespace fs = std::filesystem;

namespace {

constexpr char kPrefix[] = ".train_derail-", kSuffix[] = ".part";
constexpr std::chrono::milliseconds kReaderWait{1000}, kReaderPoll{10};

[[noreturn]] void fail(const std::string& path, const std::string& problem) {
  throw std::runtime_error(path + ": " + problem);
}
[[noreturn]] void cannot_be_written(const std::string& path, int error) {
  fail(path, fmt::format("cannot be written: {}", std::strerror(error)));
}
[[noreturn]] void fail_to_write(const std::string& path, int error) {
  fail(path, fmt::format("could not be written completely{}{}", error != 0 ? ": " : "",
                         error != 0 ? std::strerror(error) : ""));
}
[[noreturn]] void exists(const std::string& path) {
  throw ExistsError(path + ": exists already and is not overwritten");
}

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  int get() const { return fd_; }
  bool open() const { return fd_ >= 0; }
  /// Closes the descriptor; returns 0 or the number of the error.
  int close() {
    const int fd = std::exchange(fd_, -1);
    return fd >= 0 && ::close(fd) != 0 ? errno : 0;
  }

 private:
  int fd_;
};

/// A stream buffer that writes to a descriptor and remembers the error if it fails.
class Buffer : public std::streambuf {
 public:
  /// `waits`: the descriptor is a pipe. If its reader takes nothing, writing is given up some time after `stop` is set.
  Buffer(int fd, bool waits, const std::atomic<bool>* stop) : fd_(fd), stop_(waits ? stop : nullptr) {
    setp(space_.data(), space_.data() + space_.size());
  }
  int error() const { return error_; }
  std::uintmax_t written() const { return written_; }

 protected:
  int_type overflow(int_type c) override {
    if (sync() != 0) return traits_type::eof();
    if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
  }
  int sync() override {
    for (const char* from = pbase(); error_ == 0 && from < pptr();) {
      const ssize_t written = write_some(from, static_cast<std::size_t>(pptr() - from));
      if (written > 0) {
        from += written;
        written_ += static_cast<std::uintmax_t>(written);
      } else if (written == 0 || errno != EINTR) {
        error_ = written == 0 ? EIO : errno;
      }
    }
    setp(space_.data(), space_.data() + space_.size());
    return error_ == 0 ? 0 : -1;
  }

 private:
  ssize_t write_some(const char* from, std::size_t size) const {
    if (stop_ == nullptr) return ::write(fd_, from, size);
    for (auto patience = kReaderWait; patience.count() > 0;) {
      pollfd ready{fd_, POLLOUT, 0};
      const bool room = poll(&ready, 1, static_cast<int>(kReaderPoll.count())) == 1;
      if (room) return ::write(fd_, from, std::min<std::size_t>(size, PIPE_BUF));
      if (*stop_) patience -= kReaderPoll;
    }
    errno = ETIMEDOUT;
    return -1;
  }

  const int fd_;
  const std::atomic<bool>* const stop_;
  int error_ = 0;
  std::uintmax_t written_ = 0;
  std::array<char, 1 << 16> space_;
};

/// Returns the open descriptor that a path stands for: "-", /dev/stdout, /dev/fd/3 (process substitution of the shell);
/// -1 if it stands for none.
int named_descriptor(const std::string& path) {
  if (path == "-" || path == "/dev/stdout") return STDOUT_FILENO;
  if (path == "/dev/stderr") return STDERR_FILENO;
  for (const std::string folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (path.compare(0, folder.size(), folder) != 0) continue;
    int fd = -1;
    const char* end = path.data() + path.size();
    const auto [rest, error] = std::from_chars(path.data() + folder.size(), end, fd);
    if (error == std::errc() && rest == end && fd >= 0) return fd;
  }
  return -1;
}

/// Returns the path with its links followed; the file itself need not exist.
fs::path resolved(const std::string& path) {
  std::error_code error;
  fs::path whole = fs::canonical(path, error);
  if (!error) return whole;
  const fs::path name = fs::path(path).filename();
  const fs::path folder = fs::canonical(fs::absolute(path).parent_path(), error);
  return error ? fs::absolute(path) : folder / name;
}

bool named_gzip(const std::string& path) {
  constexpr std::string_view kEnd = ".gz";
  return path.size() > kEnd.size() && path.compare(path.size() - kEnd.size(), kEnd.size(), kEnd) == 0;
}

std::string temporary_name(const std::string& folder) {
  std::random_device random;
  return fmt::format("{}/{}{:08x}{:08x}{}", folder, kPrefix, random(), random(), kSuffix);
}

/// The process that writes a temporary file locks it. The lock ends with the process, also if it is killed.
bool take_lock(int fd) { return flock(fd, LOCK_EX | LOCK_NB) == 0; }

/// Removes temporary files of processes that were killed: those that nobody has locked.
void remove_stale(const std::string& folder) {
  DIR* dir = opendir(folder.c_str());
  if (dir == nullptr) return;
  while (const dirent* entry = readdir(dir)) {
    const std::string name = entry->d_name;
    const std::string suffix = kSuffix;
    if (name.compare(0, std::strlen(kPrefix), kPrefix) != 0 || name.size() < suffix.size() ||
        name.compare(name.size() - suffix.size(), suffix.size(), suffix) != 0) {
      continue;
    }
    const std::string path = folder + "/" + name;
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    struct stat status;
    if (!file.open() || fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode) || status.st_uid != geteuid())
      continue;
    if (take_lock(file.get())) unlink(path.c_str());
  }
  closedir(dir);
}

Descriptor create_named(const std::string& folder, std::string& name) {
  for (;;) {
    name = temporary_name(folder);
    Descriptor file(::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (!file.open()) {
      if (errno == EEXIST) continue;
      return file;
    }
    // Before it was locked, another process may have removed the file as one of a killed process.
    struct stat status;
    const bool locked =
        take_lock(file.get()) || errno != EWOULDBLOCK;  // a file system without locks: go on without one
    if (locked && fstat(file.get(), &status) == 0 && status.st_nlink > 0) return file;
  }
}

void sync_folder(const std::string& folder) {
  const Descriptor dir(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (dir.open()) fsync(dir.get());  // some file systems cannot sync a folder; the file itself has been synced
}

std::string link_of(int fd) { return fmt::format("/proc/self/fd/{}", fd); }

/// Opens a pipe or a device for writing.
Descriptor open_special(const std::string& path, mode_t mode) {
  if (S_ISDIR(mode)) fail(path, "is a folder, not a file");
  if (!S_ISFIFO(mode) && !S_ISCHR(mode)) fail(path, "is neither a file nor a pipe");
  // Opening a pipe without a reader would wait for ever.
  const auto start = std::chrono::steady_clock::now();
  for (;;) {
    Descriptor file(::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
    if (file.open()) {
      fcntl(file.get(), F_SETFL, fcntl(file.get(), F_GETFL) & ~O_NONBLOCK);
      return file;
    }
    if (errno != ENXIO || !S_ISFIFO(mode)) cannot_be_written(path, errno);
    if (std::chrono::steady_clock::now() - start > kReaderWait) fail(path, "cannot be written: nobody reads this pipe");
    std::this_thread::sleep_for(kReaderPoll);
  }
}

}  // namespace

struct OutputFile::Impl {
  std::string path;            // as it was given
  std::string target, folder;  // with links followed; empty for pipes and devices
  std::string temporary;       // present name of the file, if it has one
  Existing existing = Existing::refuse;
  Descriptor file;
  std::unique_ptr<Buffer> buffer;
  std::unique_ptr<std::ostream> stream;
#ifdef TRAIN_DERAIL_GZIP
  std::unique_ptr<boost::iostreams::filtering_ostream> compressed;  // writes to stream
#endif

  std::ostream& front() {
#ifdef TRAIN_DERAIL_GZIP
    if (compressed) return *compressed;
#endif
    return *stream;
  }

  void compress() {
#ifdef TRAIN_DERAIL_GZIP
    compressed = std::make_unique<boost::iostreams::filtering_ostream>();
    compressed->push(boost::iostreams::gzip_compressor());
    compressed->push(*stream);
#else
    fail(path, "this build cannot compress: it was made without Boost.Iostreams (Debian: libboost-iostreams-dev)");
#endif
  }

  /// Writes the rest and the end of what is compressed. What fails is seen by check().
  void end_compressed() {
#ifdef TRAIN_DERAIL_GZIP
    if (!compressed) return;
    if (compressed->bad()) stream->setstate(std::ios_base::badbit);
    try {
      compressed->reset();
    } catch (const std::exception&) {  // of zlib or Boost; one of the file itself is known to the buffer
      stream->setstate(std::ios_base::badbit);
    }
    compressed.reset();
#endif
  }

  ~Impl() {
    if (!temporary.empty()) unlink(temporary.c_str());
  }

  void open() {
    if (const int fd = named_descriptor(path); fd >= 0) {
      file = Descriptor(fcntl(fd, F_DUPFD_CLOEXEC, 0));
      if (!file.open()) cannot_be_written(path, errno);
      return;
    }
    if (path.empty()) fail("''", "is not the name of a file");
    struct stat status;
    const bool there = stat(path.c_str(), &status) == 0;
    if (there && !S_ISREG(status.st_mode)) {
      file = open_special(path, status.st_mode);
      return;
    }
    // If the file exists now, but did not a moment ago, another process has made it; commit() notices that.
    if (!there && lstat(path.c_str(), &status) == 0 && S_ISLNK(status.st_mode)) {
      fail(path, "cannot be written: is a link to a file that does not exist");
    }
    if (there && existing == Existing::refuse) exists(path);
    if (there && access(path.c_str(), W_OK) != 0) cannot_be_written(path, errno);
    if (!there && path.back() == '/') fail(path, "cannot be written: is the name of a folder");
    target = resolved(path).string();
    folder = fs::path(target).parent_path().string();
    remove_stale(folder);
    file = Descriptor(::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666));
    // commit() gives it its name by way of /proc.
    if (file.open() && (!take_lock(file.get()) || access(link_of(file.get()).c_str(), F_OK) != 0)) file.close();
    if (!file.open()) file = create_named(folder, temporary);
    if (!file.open()) {
      temporary.clear();
      cannot_be_written(path, errno);
    }
    if (there) static_cast<void>(fchmod(file.get(), status.st_mode & 07777));
  }

  [[noreturn]] void not_whole(int error) const { fail_to_write(path, error); }

  void check() {
    if (buffer->error() != 0) not_whole(buffer->error());
    if (stream->bad() || front().bad()) not_whole(0);  // compressing failed
  }

  bool name_it(const std::string& name) const {
    return linkat(AT_FDCWD, link_of(file.get()).c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
  }

  void commit() {
    end_compressed();
    stream->flush();
    check();
    if (!target.empty()) {
      if (fsync(file.get()) != 0) not_whole(errno);
      if (temporary.empty()) {
        if (!name_it(target)) {
          if (errno != EEXIST) cannot_be_written(path, errno);
          if (existing == Existing::refuse) exists(path);
          std::string name = temporary_name(folder);
          if (!name_it(name)) cannot_be_written(path, errno);
          temporary = std::move(name);
        }
      }
      if (!temporary.empty()) {
        try {
          move_into_place(temporary, target, existing);
        } catch (const ExistsError&) {
          exists(path);
        }
        temporary.clear();
      } else {
        sync_folder(folder);
      }
    }
    if (const int error = file.close(); error != 0) not_whole(error);
  }
};

OutputFile::OutputFile(std::string path, Existing existing, const std::atomic<bool>* stop, Compression compression)
    : impl_(std::make_unique<Impl>()) {
  impl_->path = std::move(path);
  impl_->existing = existing;
  impl_->open();
  impl_->buffer = std::make_unique<Buffer>(impl_->file.get(), impl_->target.empty(), stop);
  impl_->stream = std::make_unique<std::ostream>(impl_->buffer.get());
  if (compression == Compression::by_name && named_gzip(impl_->path)) impl_->compress();
}

OutputFile::~OutputFile() = default;
OutputFile::OutputFile(OutputFile&&) noexcept = default;
OutputFile& OutputFile::operator=(OutputFile&&) noexcept = default;

std::uintmax_t OutputFile::size() const { return impl_->buffer->written(); }
std::ostream& OutputFile::stream() { return impl_->front(); }
void OutputFile::check() { impl_->check(); }
void OutputFile::commit() { impl_->commit(); }
const std::string& OutputFile::path() const { return impl_->path; }
std::string OutputFile::name_so_far() const {
  if (impl_->target.empty()) return {};
  return impl_->temporary.empty() ? link_of(impl_->file.get()) : impl_->temporary;
}

void write_file(const std::string& path, const std::string& text, Existing existing) {
  OutputFile file(path, existing);
  file.stream() << text;
  file.commit();
}

void move_into_place(const std::string& from, const std::string& to, Existing existing) {
  bool moved = false;
  if (existing == Existing::replace) {
    moved = std::rename(from.c_str(), to.c_str()) == 0;
  } else {
    moved = renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0;
    if (!moved &&
        errno !=
            EEXIST) {  // this file system cannot rename without replacing: NFS can link instead, FAT can do neither
      if (link(from.c_str(), to.c_str()) == 0) {
        moved = unlink(from.c_str()) == 0;
      } else if (errno != EEXIST) {
        struct stat status;
        if (lstat(to.c_str(), &status) == 0) exists(to);
        moved = std::rename(from.c_str(), to.c_str()) == 0;
      }
    }
    if (!moved && errno == EEXIST) exists(to);
  }
  if (!moved) cannot_be_written(to, errno);
  sync_folder(fs::absolute(to).parent_path().string());
}

bool same_file(const std::string& a, const std::string& b) {
  const int first = named_descriptor(a), second = named_descriptor(b);
  struct stat s, t;
  const bool there = (first >= 0 ? fstat(first, &s) : stat(a.c_str(), &s)) == 0;
  if (there != ((second >= 0 ? fstat(second, &t) : stat(b.c_str(), &t)) == 0)) return false;
  // Two outputs may both go to /dev/null.
  if (there)
    return s.st_dev == t.st_dev && s.st_ino == t.st_ino && (!S_ISCHR(s.st_mode) || (first >= 0 && first == second));
  return resolved(a) == resolved(b);
}

void check_standard_output() {
  errno = 0;
  std::cout.flush();
  if (std::cout.good() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  fail_to_write("standard output", errno);  // errno is 0 if an earlier flush failed
}

}  // namespace train_derail::files
