// Programs that a test starts and that do not outlive it.
#pragma once

#include <csignal>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace train_derail::test {

class ChildProcess {
 public:
  /// `output`: file descriptor that becomes the child's standard output; -1: nowhere.
  explicit ChildProcess(const std::vector<std::string>& command, int output = -1) {
    std::vector<char*> arguments;
    for (const std::string& a : command) arguments.push_back(const_cast<char*>(a.c_str()));
    arguments.push_back(nullptr);
    pid_ = fork();
    if (pid_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nowhere = open("/dev/null", O_RDWR);
    dup2(output >= 0 ? output : nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  ~ChildProcess() { kill_now(); }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Without a chance to say goodbye.
  void kill_now() {
    if (pid_ <= 0) return;
    send(SIGKILL);
    send(SIGCONT);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
  void send(int signal) const { kill(pid_, signal); }

 private:
  pid_t pid_ = -1;
};

/// An X server without a screen. Must live as long as what draws on it.
class VirtualDisplay {
 public:
  VirtualDisplay() {
    int ends[2] = {-1, -1};
    if (pipe(ends) != 0) return;
    server_ =
        std::make_unique<ChildProcess>(std::vector<std::string>{"Xvfb", "-displayfd", "1", "-noreset", "-nolisten",
                                                                "tcp", "-screen", "0", "1600x900x24"},
                                       ends[1]);
    close(ends[1]);
    std::string number;
    for (char c = 0; read(ends[0], &c, 1) == 1 && c != '\n';) number += c;
    close(ends[0]);
    if (number.empty()) return;
    name_ = ":" + number;
    setenv("DISPLAY", name_.c_str(), 1);
    setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
    setenv("QT_X11_NO_MITSHM", "1", 1);
    setenv("QT_QPA_PLATFORM", "xcb", 1);
  }
  /// Empty if there is no X server.
  const std::string& name() const { return name_; }

 private:
  std::unique_ptr<ChildProcess> server_;
  std::string name_;
};

}  // namespace train_derail::test
