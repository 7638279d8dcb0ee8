// Files are written whole or not at all, and over nothing.
#include "folder.hpp"
#include "train_derail/files/output_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace train_derail::files {
namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string message(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

/// What becomes of a process that does it.
int status_of(const std::function<void()>& action) {
  const pid_t child = fork();
  if (child == 0) {
    action();
    _exit(0);
  }
  int status = -1;
  waitpid(child, &status, 0);
  return status;
}

class OutputFileTest : public test::Folder {
 protected:
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : fs::directory_iterator(folder_)) all.push_back(entry.path().filename().string());
    std::sort(all.begin(), all.end());
    return all;
  }
  void put(const std::string& name, const std::string& text) const { write(name, text); }
};

TEST_F(OutputFileTest, HasItsNameWhenItIsWhole) {
  const std::string large(300000, 'x');
  {
    OutputFile file(at("a.csv"));
    file.stream() << large << "end\n";
    EXPECT_FALSE(fs::exists(at("a.csv")));
    file.commit();
    EXPECT_EQ(content(at("a.csv")), large + "end\n");
  }
  EXPECT_EQ(names(), std::vector<std::string>{"a.csv"});
  const mode_t mask = umask(0);
  umask(mask);
  EXPECT_EQ(static_cast<mode_t>(fs::status(at("a.csv")).permissions()), 0666 & ~mask);
}

TEST_F(OutputFileTest, ANameThatEndsInGzIsCompressedUnlessTheFileIsReadAsItIs) {
  const std::string text(100000, 'x');
  write_file(at("plain"), text);
  EXPECT_EQ(content(at("plain")), text);
  OutputFile raw(at("raw.gz"), Existing::refuse, nullptr, Compression::never);
  raw.stream() << text;
  raw.commit();
  EXPECT_EQ(content(at("raw.gz")), text);
#ifdef TRAIN_DERAIL_GZIP
  write_file(at("a.gz"), text);
  EXPECT_EQ(content(at("a.gz")).substr(0, 2), "\x1f\x8b");
  EXPECT_LT(content(at("a.gz")).size(), 1000U);
  // A full disk is noticed while the file is closed, and when what is compressed does not fit any more.
  fs::create_symlink("/dev/full", at("full.gz"));
  EXPECT_NE(message([&] { write_file(at("full.gz"), "little"); }).find("No space left on device"), std::string::npos);
  OutputFile broken(at("broken.gz"));
  broken.stream() << text;
  broken.stream().setstate(std::ios_base::badbit);  // as Boost does if compressing fails
  EXPECT_EQ(message([&] { broken.check(); }), at("broken.gz") + ": could not be written completely");
  EXPECT_EQ(message([&] { broken.commit(); }), at("broken.gz") + ": could not be written completely");
  EXPECT_FALSE(fs::exists(at("broken.gz")));
#endif
}

TEST_F(OutputFileTest, LeavesNothingIfItIsNotCommitted) {
  { OutputFile(at("a.csv")).stream() << "half" << std::flush; }
  EXPECT_TRUE(names().empty());
}

TEST_F(OutputFileTest, AKillLeavesNothing) {
  for (const Existing existing : {Existing::refuse, Existing::replace}) {
    const int status = status_of([&] {
      OutputFile file(at("a.csv"), existing);
      file.stream() << "half" << std::flush;
      raise(SIGKILL);
    });
    EXPECT_TRUE(WIFSIGNALED(status));
    OutputFile(at("b.csv"));  // takes away what the file system could not hide
    EXPECT_TRUE(names().empty());
  }
}

TEST_F(OutputFileTest, WhatIsThereStays) {
  put("a.csv", "mine");
  EXPECT_THROW(OutputFile(at("a.csv")), ExistsError);
  EXPECT_EQ(message([&] { write_file(at("a.csv"), "other"); }),
            at("a.csv") + ": exists already and is not overwritten");
  OutputFile late(at("b.csv"));
  put("b.csv", "mine too");  // while it is computed
  EXPECT_THROW(late.commit(), ExistsError);
  EXPECT_EQ(content(at("a.csv")), "mine");
  EXPECT_EQ(content(at("b.csv")), "mine too");
}

TEST_F(OutputFileTest, ReplacesWhenToldToAndKeepsWhoMayRead) {
  put("a.csv", "old");
  ASSERT_EQ(chmod(at("a.csv").c_str(), 0600), 0);
  fs::create_symlink(at("a.csv"), at("link.csv"));
  OutputFile file(at("link.csv"), Existing::replace);
  file.stream() << "new";
  EXPECT_EQ(content(at("a.csv")), "old");
  file.commit();
  EXPECT_EQ(content(at("a.csv")), "new");
  EXPECT_TRUE(fs::is_symlink(at("link.csv")));
  EXPECT_EQ(static_cast<int>(fs::status(at("a.csv")).permissions()), 0600);
  EXPECT_EQ(names(), (std::vector<std::string>{"a.csv", "link.csv"}));
}

TEST_F(OutputFileTest, TemporariesOfTheDeadAreRemovedThoseOfTheLivingStay) {
  put(".train_derail-00.part", "left by a killed process");
  put(".train_derail-not", "somebody's");
  int lock[2], end[2];
  ASSERT_EQ(pipe(lock) + pipe(end), 0);
  const pid_t living = fork();
  if (living == 0) {
    const int file = open(at(".train_derail-11.part").c_str(), O_WRONLY | O_CREAT, 0666);
    flock(file, LOCK_EX);
    char c = 'x';
    if (::write(lock[1], &c, 1) != 1 || read(end[0], &c, 1) != 1) _exit(1);
    _exit(0);
  }
  char c = 'x';
  ASSERT_EQ(read(lock[0], &c, 1), 1);
  OutputFile(at("a.csv"));
  EXPECT_EQ(names(), (std::vector<std::string>{".train_derail-11.part", ".train_derail-not"}));
  ASSERT_EQ(::write(end[1], &c, 1), 1);
  waitpid(living, nullptr, 0);
  for (const int fd : {lock[0], lock[1], end[0], end[1]}) close(fd);
}

TEST_F(OutputFileTest, SaysWhyItCannotBeWritten) {
  EXPECT_EQ(message([&] { OutputFile(at("none/a.csv")); }),
            at("none/a.csv") + ": cannot be written: No such file or directory");
  EXPECT_EQ(message([&] { OutputFile(folder_.string()); }), folder_.string() + ": is a folder, not a file");
  EXPECT_EQ(message([&] { OutputFile(at("new/")); }), at("new/") + ": cannot be written: is the name of a folder");
  EXPECT_EQ(message([&] { OutputFile(""); }), "'': is not the name of a file");
  fs::create_symlink(at("nowhere"), at("dangling"));
  EXPECT_EQ(message([&] { OutputFile(at("dangling")); }),
            at("dangling") + ": cannot be written: is a link to a file that does not exist");
  EXPECT_NE(message([&] { OutputFile(at(std::string(300, 'n'))).commit(); }), "");
  EXPECT_EQ(names(), std::vector<std::string>{"dangling"});
}

TEST_F(OutputFileTest, AFullDeviceIsNoticed) {
  EXPECT_EQ(message([] { write_file("/dev/full", "text"); }),
            "/dev/full: could not be written completely: No space left on device");
  OutputFile full("/dev/full");
  full.stream() << "text" << std::flush;
  EXPECT_FALSE(full.stream());
  EXPECT_THROW(full.check(), std::runtime_error);

  // A limit of the size has the same effect as the end of a disk.
  const int status = status_of([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100000, 100000};
    setrlimit(RLIMIT_FSIZE, &limit);
    const std::string said = message([&] { write_file(at("a.csv"), std::string(200000, 'x')); });
    _exit(said == at("a.csv") + ": could not be written completely: File too large" ? 0 : 1);
  });
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_TRUE(names().empty());
}

// As on a disk that is full, whoever runs this.
TEST_F(OutputFileTest, WithoutSpaceWhatWasThereStays) {
  put("old.csv", "old");
  const int status = status_of([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100000, 100000};
    setrlimit(RLIMIT_FSIZE, &limit);
    const bool refused =
        !message([&] { write_file(at("old.csv"), std::string(200000, 'x'), Existing::replace); }).empty();
    const bool kept = content(at("old.csv")) == "old";
    write_file(at("old.csv"), "new", Existing::replace);
    _exit(refused && kept ? 0 : 1);
  });
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(content(at("old.csv")), "new");
  EXPECT_EQ(names().size(), 1u);
}

TEST_F(OutputFileTest, PipesAndDevicesAreWrittenAsItComes) {
  write_file("/dev/null", "text");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  ASSERT_EQ(mkfifo(at("pipe").c_str(), 0600), 0);
  EXPECT_EQ(message([&] { OutputFile(at("pipe")); }), at("pipe") + ": cannot be written: nobody reads this pipe");
  std::string read;
  std::thread reader([&] { read = content(at("pipe")); });
  write_file(at("pipe"), "through the pipe");
  reader.join();
  EXPECT_EQ(read, "through the pipe");
  EXPECT_TRUE(fs::is_fifo(at("pipe")));

  // What a shell makes of >(program).
  const int file = open(at("a.csv").c_str(), O_WRONLY | O_CREAT, 0666);
  write_file("/dev/fd/" + std::to_string(file), "by number");
  close(file);
  EXPECT_EQ(content(at("a.csv")), "by number");
}

TEST_F(OutputFileTest, OneFileByTwoNames) {
  put("a", "");
  put("b", "");
  fs::create_symlink(at("a"), at("link"));
  fs::create_hard_link(at("a"), at("hard"));
  fs::create_directory(at("sub"));
  EXPECT_TRUE(same_file(at("a"), at("link")));
  EXPECT_TRUE(same_file(at("a"), at("hard")));
  EXPECT_TRUE(same_file(at("a"), at("sub/../a")));
  EXPECT_TRUE(same_file(at("new"), at("sub/../new")));
  EXPECT_TRUE(same_file("new", "./new"));
  EXPECT_TRUE(same_file("-", "/dev/stdout"));
  EXPECT_FALSE(same_file(at("a"), at("b")));
  EXPECT_FALSE(same_file(at("a"), at("new")));
  EXPECT_FALSE(same_file(at("new"), at("sub/new")));
  EXPECT_FALSE(same_file("/dev/null", "/dev/null"));
}

TEST_F(OutputFileTest, MovesOverNothing) {
  put("from", "whole");
  put("to", "mine");
  EXPECT_THROW(move_into_place(at("from"), at("to"), Existing::refuse), ExistsError);
  EXPECT_EQ(content(at("from")) + content(at("to")), "wholemine");
  move_into_place(at("from"), at("to"), Existing::replace);
  put("more", "more");
  move_into_place(at("more"), at("new"), Existing::refuse);
  EXPECT_EQ(content(at("to")) + content(at("new")), "wholemore");
  EXPECT_EQ(names(), (std::vector<std::string>{"new", "to"}));
}

}  // namespace
}  // namespace train_derail::files
