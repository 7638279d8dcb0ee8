#include "train_derail/ros/study_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <ros/serialization.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/ros/pacer.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/study/summary.hpp"

extern char** environ;

namespace train_derail::ros_face {

namespace {

namespace fs = std::filesystem;

constexpr char kWhere[] = "~run_study";
constexpr std::uint32_t kJobsPerCore = 4;
/// The live simulation goes first where cores are scarce.
constexpr int kNice = 10;
/// Of the process: half of the machine's memory, at most this.
constexpr std::uint64_t kMemoryMax = 4ULL << 30;
/// Between being asked to end and being killed, wall [s].
constexpr double kGrace = 0.8;
constexpr int kPollMs = 50;

/// What goes through the pipe: a head, then a serialised message.
enum class Kind : std::uint32_t { feedback = 1, result = 2 };
struct Head {
  Kind kind;
  std::uint32_t size;
};
constexpr std::uint32_t kMessageMax = 64U << 20;

std::uint64_t memory_limit() {
  const auto all =
      static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
  return std::min(all / 2, kMemoryMax);
}

template <class Message>
std::vector<std::uint8_t> to_bytes(const Message& message) {
  std::vector<std::uint8_t> bytes(::ros::serialization::serializationLength(message));
  ::ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ::ros::serialization::serialize(stream, message);
  return bytes;
}

template <class Message>
Message from_bytes(std::uint8_t* bytes, std::size_t size) {
  Message message;
  ::ros::serialization::IStream stream(bytes, static_cast<std::uint32_t>(size));
  ::ros::serialization::deserialize(stream, message);
  return message;
}

/// False if the other end is gone.
bool write_all(int file, const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t done = write(file, at, size);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    at += done;
    size -= static_cast<std::size_t>(done);
  }
  return true;
}

std::vector<std::uint8_t> read_all(int file) {
  std::vector<std::uint8_t> all;
  std::uint8_t part[1 << 16];
  for (;;) {
    const ssize_t count = read(file, part, sizeof part);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return all;
    all.insert(all.end(), part, part + count);
  }
}

// In the process of the study

std::atomic<bool> g_stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may touch it only then");
void request_stop(int /*signal*/) { g_stop = true; }

template <class Message>
void tell(int file, Kind kind, const Message& message) {
  const std::vector<std::uint8_t> bytes = to_bytes(message);
  const Head head{kind, static_cast<std::uint32_t>(bytes.size())};
  if (!write_all(file, &head, sizeof head) || !write_all(file, bytes.data(), bytes.size())) std::_Exit(1);
}

/// Asks `bounds` for every file that a study names, before it is opened. Throws inputs::InputError.
void look_at_study(const YAML::Node& tree, const std::string& file, const FileBounds& bounds, std::size_t depth) {
  if (!tree.IsMap()) return;  // what is wrong with it, its reader says
  const fs::path folder = fs::path(file).parent_path();
  const auto look_at_scenario = [&](const YAML::Node& scenario, const std::string& source) {
    inputs::layers(scenario, source, fs::path(source).parent_path().string(), bounds.asking(source));
  };
  const auto named_file = [&](const char* key) {
    const YAML::Node named = tree[key];
    const bool is_file = named && named.IsScalar() && !named.Scalar().empty();
    return is_file ? bounds.readable(file, key, (folder / named.Scalar()).string()) : std::string();
  };
  if (const std::string base = named_file("base"); !base.empty() && depth < inputs::kBasesMax)
    look_at_study(inputs::load_file(base), base, bounds, depth + 1);
  if (const std::string scenario = named_file("scenario"); !scenario.empty()) {
    look_at_scenario(inputs::load_file(scenario), scenario);
  } else if (const YAML::Node own = tree["scenario"]; own && own.IsMap()) {
    look_at_scenario(own, file);
  }
}

/// The goal with its paths resolved, if all that it names may be touched. Throws inputs::InputError.
study::Study read_within(const RunStudyGoal& goal, const FileBounds& bounds) {
  const bool is_text = !goal.text.empty();
  std::string file = (fs::path(bounds.results()) / kWhere).string();
  if (!is_text || !goal.file.empty()) file = bounds.readable(kWhere, "file", goal.file);
  const YAML::Node tree = is_text ? inputs::load_text(goal.text, file) : inputs::load_file(file);
  look_at_study(tree, file, bounds, 0);
  return is_text ? study::read_study_text(goal.text, file) : study::read_study_file(file);
}

RunStudyFeedback to_message(const study::Progress& p) {
  RunStudyFeedback m;
  m.done = p.done;
  m.total = p.total;
  m.failed = p.failed;
  m.rate = p.rate;
  m.eta = p.rate > 0.0 ? static_cast<double>(p.total - p.done) / p.rate : 0.0;
  m.message = p.message;
  return m;
}

/// What is an option of the command line is a field of the goal.
std::string in_words_of_the_goal(std::string message) {
  const std::string option = "--resume";
  for (auto at = message.find(option); at != std::string::npos; at = message.find(option)) message.erase(at, 2);
  return message;
}

RunStudyResult run(const RunStudyGoal& goal, const FileBounds& bounds,
                   const std::function<void(const RunStudyFeedback&)>& feedback) {
  RunStudyResult result;
  result.folder = goal.folder;
  try {
    study::RunOptions options;
    options.folder = bounds.writable(kWhere, "folder", goal.folder);
    const study::Study study = read_within(goal, bounds);
    options.jobs = static_cast<int>(goal.jobs);
    options.resume = goal.resume != 0;
    result.folder = options.folder;
    fs::create_directories(bounds.results());
    const study::RunReport report = study::run_study(
        study, options, [&](const study::Progress& p) { feedback(to_message(p)); }, g_stop);
    result.runs = report.runs;
    result.computed = report.computed;
    result.failed = report.failed;
    result.wall_time = report.wall_time;
    if (report.stopped) {
      result.status = RunStudyResult::STOPPED;
      result.message = fmt::format("stopped with {} runs on disk; resume computes the rest", report.runs);
      return result;
    }
    const study::Totals totals = study::write_results(options.folder, study, report.wall_time, &g_stop);
    result.table = study::to_table(options.folder, study);
    result.status = RunStudyResult::DONE;
    result.message = fmt::format("{} runs in {}", report.runs, options.folder);
    if (report.failed > 0) {
      result.message +=
          fmt::format("; {} of {} failed, their rows in runs.csv say why", report.failed, report.computed);
    }
    if (!report.problems.empty()) {
      result.message += fmt::format("; {} lines of journals were not believed and computed anew, the first: {}",
                                    report.problems.size(), report.problems.front());
    }
    for (const std::string& warning : totals.warnings) result.message += "; warning: " + warning;
  } catch (const study::Stopped&) {
    result.status = RunStudyResult::STOPPED;
    result.message = "stopped before the tables were whole; resume writes them";
  } catch (const inputs::InputError& e) {
    result.status = RunStudyResult::INPUT_WRONG;
    result.message = e.what();
  } catch (const std::bad_alloc&) {
    result.status = RunStudyResult::OUTPUT_FAILED;
    result.message = fmt::format(
        "{}: needs more than the {} MiB that a study in the node may have; derail study has no "
        "such limit",
        kWhere, memory_limit() >> 20);
  } catch (const std::exception& e) {
    result.status = RunStudyResult::OUTPUT_FAILED;
    result.message = in_words_of_the_goal(e.what());
  }
  return result;
}

void be_modest() {
  setpriority(PRIO_PROCESS, 0, kNice);
  std::ofstream("/proc/self/oom_score_adj") << 1000;  // the first to go where memory is scarce
  // A sanitizer's own books are larger than any limit.
#if !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
  const rlimit limit{memory_limit(), memory_limit()};
  setrlimit(RLIMIT_DATA, &limit);
#endif
}

// In the node

/// The pipes and the process; kills what is left of it.
class Child {
 public:
  explicit Child(const FileBounds& bounds) {
    int to[2], from[2];
    if (pipe2(to, O_CLOEXEC) != 0) throw std::runtime_error(fmt::format("no pipe: {}", std::strerror(errno)));
    if (pipe2(from, O_CLOEXEC) != 0) {
      const int error = errno;
      close(to[0]);
      close(to[1]);
      throw std::runtime_error(fmt::format("no pipe: {}", std::strerror(error)));
    }
    std::vector<std::string> arguments{"train_derail_study", kStudyWorker, std::to_string(getpid()), bounds.results()};
    arguments.insert(arguments.end(), bounds.further().begin(), bounds.further().end());
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);

    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, to[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&files, from[1], STDOUT_FILENO);
    // The node's connections are not the study's: a peer would wait on them when the node is gone.
    posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setpgroup(&attributes, 0);  // an interrupt from the terminal is for the node
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    const int error = posix_spawn(&pid_, "/proc/self/exe", &files, &attributes, pointers.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    close(to[0]);
    close(from[1]);
    to_ = to[1];
    from_ = from[0];
    if (error != 0) {
      close(to_);
      close(from_);
      throw std::runtime_error(fmt::format("the study's process does not start: {}", std::strerror(error)));
    }
  }
  ~Child() {
    close_input();
    close(from_);
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    wait();
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  void give(const std::vector<std::uint8_t>& bytes) {
    write_all(to_, bytes.data(), bytes.size());
    close_input();
  }
  /// Appends what it says; false at its end. Returns at least every kPollMs.
  bool listen(std::vector<std::uint8_t>& heard) const {
    pollfd poll_on{from_, POLLIN, 0};
    if (poll(&poll_on, 1, kPollMs) <= 0) return true;
    std::uint8_t part[1 << 16];
    const ssize_t count = read(from_, part, sizeof part);
    if (count < 0) return errno == EINTR;
    heard.insert(heard.end(), part, part + count);
    return count > 0;
  }
  void send(int signal) const { kill(pid_, signal); }
  int wait() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

 private:
  void close_input() {
    if (to_ >= 0) close(to_);
    to_ = -1;
  }

  pid_t pid_ = -1;
  int to_ = -1, from_ = -1;
};

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status)) return fmt::format("ended by signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  return fmt::format("ended with exit code {}", WEXITSTATUS(status));
}

}  // namespace

std::uint32_t study_jobs_max() { return kJobsPerCore * std::max(1U, std::thread::hardware_concurrency()); }

RunStudyResult run_study_process(const RunStudyGoal& goal, const FileBounds& bounds,
                                 const std::function<void(const RunStudyFeedback&)>& feedback,
                                 const std::atomic<bool>& stop) {
  RunStudyFeedback last;
  std::optional<RunStudyResult> result;
  RunStudyResult broken;
  broken.folder = goal.folder;
  broken.status = RunStudyResult::OUTPUT_FAILED;
  try {
    Child child(bounds);
    child.give(to_bytes(goal));
    std::vector<std::uint8_t> heard;
    std::optional<WallTime> kill_at;
    while (child.listen(heard)) {
      std::size_t at = 0;
      for (Head head{}; heard.size() - at >= sizeof head; at += sizeof head + head.size) {
        std::memcpy(&head, heard.data() + at, sizeof head);
        if (head.size > kMessageMax) throw std::runtime_error("the study's process says what is no message");
        if (heard.size() - at < sizeof head + head.size) break;
        std::uint8_t* const body = heard.data() + at + sizeof head;
        if (head.kind == Kind::result) {
          result = from_bytes<RunStudyResult>(body, head.size);
        } else {
          last = from_bytes<RunStudyFeedback>(body, head.size);
          feedback(last);
        }
      }
      heard.erase(heard.begin(), heard.begin() + static_cast<std::ptrdiff_t>(at));
      if (!stop) continue;
      const WallTime now = WallClock::now();
      if (!kill_at) {
        child.send(SIGTERM);
        kill_at = now + wall_seconds(kGrace);
      } else if (now >= *kill_at) {
        child.send(SIGKILL);
      }
    }
    const int status = child.wait();
    if (result) return *result;
    broken.runs = last.done;
    broken.failed = last.failed;
    if (stop) {
      broken.status = RunStudyResult::STOPPED;
      broken.message = fmt::format("stopped with {} runs on disk; resume computes the rest", last.done);
    } else {
      broken.message = fmt::format("{}: the study's process {}; {} runs are on disk, resume computes the rest", kWhere,
                                   how_it_ended(status), last.done);
    }
  } catch (const std::exception& e) {
    broken.message = fmt::format("{}: {}", kWhere, e.what());
  }
  return broken;
}

int study_worker(int argc, char** argv) {
  constexpr int kArgumentsMin = 4;
  pid_t parent = 0;
  if (argc < kArgumentsMin) return 2;
  std::from_chars(argv[2], argv[2] + std::strlen(argv[2]), parent);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) return 1;  // it has ended before it could take us along
  be_modest();
  std::signal(SIGTERM, request_stop);
  std::signal(SIGINT, request_stop);
  // What libraries print is not for the pipe.
  const int answers = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  const FileBounds bounds(argv[3], {argv + kArgumentsMin, argv + argc});
  RunStudyResult result;
  try {
    std::vector<std::uint8_t> bytes = read_all(STDIN_FILENO);
    const RunStudyGoal goal = from_bytes<RunStudyGoal>(bytes.data(), bytes.size());
    result = run(goal, bounds, [&](const RunStudyFeedback& m) { tell(answers, Kind::feedback, m); });
  } catch (const std::exception& e) {
    result.status = RunStudyResult::OUTPUT_FAILED;
    result.message = fmt::format("{}: {}", kWhere, e.what());
  }
  tell(answers, Kind::result, result);
  return 0;
}

}  // namespace train_derail::ros_face
