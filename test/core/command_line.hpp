// The command line as a process: what it is asked, its exit code, what it prints.
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

#include "folder.hpp"

namespace train_derail::test {

struct Result {
  int code = -1;
  std::string out;
};

/// Runs a command of the shell.
inline Result run(const std::string& command) {
  Result result;
  FILE* pipe = popen(command.c_str(), "r");
  std::array<char, 4096> buffer;
  for (std::size_t n; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) result.out.append(buffer.data(), n);
  const int status = pclose(pipe);
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

/// Runs `derail` with arguments for the shell; standard error joins standard output if `errors`.
inline Result derail(const std::string& arguments, bool errors = true) {
  return run(std::string(TRAIN_DERAIL_CLI) + " " + arguments + (errors ? " 2>&1" : " 2>/dev/null"));
}

/// The same in a folder.
inline Result derail_in(const std::filesystem::path& folder, const std::string& arguments) {
  const std::string enter = "cd '" + folder.string() + "' && ";
  return run(enter + TRAIN_DERAIL_CLI + " " + arguments + " 2>&1");
}

class Cli : public Folder {};

}  // namespace train_derail::test
