#include "page.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <fmt/format.h>

namespace train_derail::apps {

namespace fs = std::filesystem;

namespace {

constexpr const char* kScript = "make_page.py";

/// A script: beside this program, where a build has it, or where scripts are installed.
fs::path found(const std::string& script) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error), folder = program.parent_path();
  for (const fs::path& path : {folder / script, folder / TRAIN_DERAIL_TO_SCRIPTS / script}) {
    if (fs::exists(path, error)) return path;
  }
  throw std::runtime_error(
      fmt::format("{}: not found beside {} nor in {}", script, program.string(), TRAIN_DERAIL_TO_SCRIPTS));
}

/// A file in memory that nobody else sees.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("train_derail", MFD_CLOEXEC)) {
    if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "memfd_create");
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }
  void write(const std::string& text) const {
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t n = ::write(descriptor_, text.data() + done, text.size() - done);
      if (n < 0 && errno != EINTR) throw std::system_error(errno, std::generic_category(), "writing to memory");
      if (n > 0) done += static_cast<std::size_t>(n);
    }
    lseek(descriptor_, 0, SEEK_SET);
  }
  std::string read() const {
    std::string text(static_cast<std::size_t>(lseek(descriptor_, 0, SEEK_END)), '\0');
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t n = pread(descriptor_, text.data() + done, text.size() - done, static_cast<off_t>(done));
      if (n == 0 || (n < 0 && errno != EINTR))
        throw std::system_error(errno, std::generic_category(), "reading memory");
      if (n > 0) done += static_cast<std::size_t>(n);
    }
    return text;
  }

 private:
  int descriptor_;
};

}  // namespace

std::string run_script(const std::string& script, std::vector<std::string> arguments, const std::string& input) {
  const MemoryFile in, out, said;
  in.write(input);
  arguments.insert(arguments.begin(), found(script).string());
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, in.descriptor(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, out.descriptor(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, said.descriptor(), STDERR_FILENO);
  pid_t child = 0;
  const int failed = posix_spawn(&child, argv[0], &files, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0) throw std::runtime_error(fmt::format("{}: {}", arguments[0], std::strerror(failed)));
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw std::system_error(errno, std::generic_category(), "waitpid");
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return out.read();
  std::string message = said.read();
  while (!message.empty() && message.back() == '\n') message.pop_back();
  const std::string how = WIFSIGNALED(status)
                              ? fmt::format("killed by signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)))
                              : fmt::format("exit code {}", WEXITSTATUS(status));
  throw std::runtime_error(fmt::format("{}: {}{}{}", script, how, message.empty() ? "" : ": ", message));
}

void require_page_maker(const std::string& template_name) { run_script(kScript, {"--check", template_name}, ""); }

std::string make_page(const std::string& template_name, const std::string& document) {
  return run_script(kScript, {template_name}, document);
}

}  // namespace train_derail::apps
