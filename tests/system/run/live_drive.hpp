#pragma once
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/run/session.hpp"

namespace vergence::test {

/// The program on a drive of the mock in real time, as the leader of a session of its own: with a
/// terminal, or with none.
class Drive {
 public:
  /// `errors`: a descriptor that is its standard error; −1: the terminal, or the test's.
  Drive(const std::filesystem::path& session, bool terminal, int seconds,
        const std::vector<std::string>& more = {"--quiet"}, int errors = -1) {
    std::vector<std::string> words{VERGENCE_PROGRAM,
                                   "run",
                                   std::string(VERGENCE_SOURCE_DIR) + "/app/config/mock.yaml",
                                   "--duration",
                                   std::to_string(seconds),
                                   "--out",
                                   session.string(),
                                   "--record",
                                   "poses",
                                   "--set",
                                   "cameras.0.size=[320,240]",
                                   "--set",
                                   "cameras.1.size=[320,240]",
                                   "--set",
                                   "mock.texture_detail=0"};
    words.insert(words.end(), more.begin(), more.end());
    std::vector<char*> pointers;
    for (std::string& w : words) pointers.push_back(w.data());
    pointers.push_back(nullptr);
    pid_ = terminal ? ::forkpty(&terminal_, nullptr, nullptr, nullptr) : ::fork();
    if (pid_ != 0) return;
    if (!terminal) (void)::setsid();
    if (errors >= 0) (void)::dup2(errors, STDERR_FILENO);
    (void)::execv(pointers.front(), pointers.data());
    ::_exit(127);
  }
  ~Drive() {
    close_terminal();
    if (pid_ > 0 && ::kill(pid_, SIGKILL) == 0) (void)::waitpid(pid_, nullptr, 0);
  }
  Drive(const Drive&) = delete;
  Drive& operator=(const Drive&) = delete;

  void signal(int number) const { (void)::kill(pid_, number); }
  [[nodiscard]] int terminal() const { return terminal_; }
  void close_terminal() {
    if (terminal_ >= 0) (void)::close(terminal_);
    terminal_ = -1;
  }
  /// → exit code; 128 + the signal's number. −1: it is still there after so long.
  int wait(std::chrono::seconds limit = std::chrono::seconds(200)) {
    const auto end = std::chrono::steady_clock::now() + limit;
    for (int status = 0; std::chrono::steady_clock::now() < end;
         std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
      if (::waitpid(pid_, &status, WNOHANG) != pid_) continue;
      pid_ = -1;
      return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    return -1;
  }

 private:
  pid_t pid_ = -1;
  int terminal_ = -1;
};

template <class Holds>
bool within(std::chrono::seconds limit, const Holds& holds) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!holds())
    if (std::chrono::steady_clock::now() > end)
      return false;
    else
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return true;
}

[[nodiscard]] inline std::string head_of(const std::filesystem::path& file) {
  const std::string text = text_of(file);
  return text.substr(0, text.find('\n'));
}

[[nodiscard]] inline std::size_t lines_of(const std::filesystem::path& file) {
  const std::string text = text_of(file);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace vergence::test
