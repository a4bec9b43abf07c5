#pragma once
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace vergence::test {

/// The built program as a child process; killed by the destructor.
class ChildProgram {
 public:
  /// Options of the start.
  struct Start {
    /// Starts as leader of its session, with a terminal of its own.
    bool terminal = false;
    /// Starts as leader of a session without a terminal.
    bool session = false;
    /// Descriptor that is its standard error; −1: the terminal, or the test's.
    int errors = -1;
  };

  /// `words`: what stands behind the program's name.
  explicit ChildProgram(std::vector<std::string> words) : ChildProgram(std::move(words), Start{}) {}
  ChildProgram(std::vector<std::string> words, const Start& start) {
    words.insert(words.begin(), VERGENCE_PROGRAM);
    std::vector<char*> pointers;
    for (std::string& w : words) pointers.push_back(w.data());
    pointers.push_back(nullptr);
    pid_ = start.terminal ? ::forkpty(&terminal_, nullptr, nullptr, nullptr) : ::fork();
    if (pid_ != 0) return;
    if (start.session) (void)::setsid();
    if (start.errors >= 0) (void)::dup2(start.errors, STDERR_FILENO);
    (void)::execv(pointers.front(), pointers.data());
    ::_exit(127);
  }
  ~ChildProgram() {
    close_terminal();
    if (pid_ > 0 && ::kill(pid_, SIGKILL) == 0) (void)::waitpid(pid_, nullptr, 0);
  }
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  void signal(int number) const { (void)::kill(pid_, number); }
  [[nodiscard]] pid_t pid() const { return pid_; }
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

}  // namespace vergence::test
