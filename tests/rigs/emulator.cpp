#include "tests/rigs/emulator.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace vergence::test {
namespace {

/// A bus reset takes two seconds.
constexpr auto kReadyLimit = std::chrono::seconds(10);
constexpr auto kLook = std::chrono::milliseconds(20);

}  // namespace

Emulator::Emulator(const std::string& program, std::vector<std::string> arguments) {
  const char* folder = std::getenv("VERGENCE_RIGS");
  const std::string path =
      (folder != nullptr ? std::string(folder) + "/" : std::string()) + program;
  static int number = 0;
  const std::string ready = "/run/ready-" + std::to_string(++number);
  arguments.insert(arguments.begin(), path);
  arguments.insert(arguments.end(), {"--ready", ready});
  std::vector<char*> words;
  for (std::string& a : arguments) words.push_back(a.data());
  words.push_back(nullptr);

  std::array<int, 2> in{}, out{};
  if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0)
    throw std::runtime_error("no pipe for " + path);
  pid_ = ::fork();
  if (pid_ == 0) {
    (void)::dup2(in[0], 0);
    (void)::dup2(out[1], 1);
    (void)::execv(path.c_str(), words.data());
    ::_exit(127);
  }
  (void)::close(in[0]);
  (void)::close(out[1]);
  commands_ = in[1];
  report_ = out[0];
  const auto end = std::chrono::steady_clock::now() + kReadyLimit;
  while (!std::filesystem::exists(ready)) {
    if (std::chrono::steady_clock::now() > end || ::waitpid(pid_, nullptr, WNOHANG) == pid_) {
      (void)finish();
      throw std::runtime_error(path + " does not run, or has no devices");
    }
    std::this_thread::sleep_for(kLook);
  }
}

Emulator::~Emulator() { (void)finish(); }

void Emulator::command(std::string_view line) {
  const std::string whole = std::string(line) + "\n";
  if (::write(commands_, whole.data(), whole.size()) != static_cast<ssize_t>(whole.size()))
    throw std::runtime_error("the emulator does not listen any more");
}

std::string Emulator::finish() {
  std::string report;
  if (commands_ >= 0) {
    (void)::signal(SIGPIPE, SIG_IGN);
    (void)!::write(commands_, "quit\n", 5);
    (void)::close(commands_);
    std::array<char, 512> piece{};
    for (ssize_t n = 0; (n = ::read(report_, piece.data(), piece.size())) > 0;)
      report.append(piece.data(), static_cast<std::size_t>(n));
    (void)::close(report_);
    (void)::waitpid(pid_, nullptr, 0);
    commands_ = report_ = -1;
  }
  return report;
}

bool inside_rig() { return std::getenv("VERGENCE_RIGS") != nullptr; }

std::int64_t count_of(const std::string& report, int camera, std::string_view word) {
  std::istringstream lines(report);
  const std::string name = "camera " + std::to_string(camera) + " ";
  for (std::string line; std::getline(lines, line);) {
    const std::size_t at = line.find(name);
    const std::size_t key =
        at == std::string::npos ? at : line.find(" " + std::string(word) + " ", at);
    if (key != std::string::npos) return std::atoll(line.c_str() + key + word.size() + 2);
  }
  return -1;
}

}  // namespace vergence::test
