#include "tests/unit/firmware_iface/trigger/board/qemu_board.hpp"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <stdexcept>

namespace vergence {
namespace {

constexpr auto kPatience = std::chrono::seconds(10);

/// Both ends of a socket pair; ours is kept from the child, the child's is given a fixed number
/// there.
struct Ends {
  int ours = -1, theirs = -1;
};

Ends make_ends() {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    throw std::runtime_error("socketpair");
  return {ends[0], ends[1]};
}

void write_all(int fd, const void* data, std::size_t size) {
  const auto* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t n = ::send(fd, at, size, MSG_NOSIGNAL);
    if (n <= 0) throw std::runtime_error("the machine has gone");
    at += n;
    size -= static_cast<std::size_t>(n);
  }
}

}  // namespace

std::string QemuBoard::missing() {
  if (std::string(VERGENCE_BOARD_IMAGE).empty())
    return "no image of the trigger board: gcc-arm-none-eabi was not there to build it";
  if (std::string(VERGENCE_QEMU_ARM).empty())
    return "no qemu-system-arm to run the trigger board's image in";
  return {};
}

QemuBoard::QemuBoard(int icount_shift) {
  constexpr int kLine = 100;  // number of the child's end
  const Ends ends = make_ends();
  std::vector<std::string> arguments = {VERGENCE_QEMU_ARM,
                                        "-M",
                                        "netduinoplus2",
                                        "-display",
                                        "none",
                                        "-nodefaults",
                                        "-kernel",
                                        VERGENCE_BOARD_IMAGE,
                                        "-serial",
                                        "chardev:line",
                                        "-chardev",
                                        "socket,id=line,fd=" + std::to_string(kLine)};
  if (icount_shift >= 0)
    arguments.insert(arguments.end(),
                     {"-icount", "shift=" + std::to_string(icount_shift) + ",sleep=off"});
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);

  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("fork");
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    dup2(ends.theirs, kLine);
    execv(argv[0], argv.data());
    _exit(127);
  }
  ::close(ends.theirs);
  line_ = ends.ours;
  reader_ = std::thread([this] { read_line(); });
  (void)wait(trigger_status);  // it listens now
}

QemuBoard::~QemuBoard() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  ::shutdown(line_, SHUT_RDWR);
  if (reader_.joinable()) reader_.join();
  ::close(line_);
}

void QemuBoard::read_line() {
  TriggerDecoder decoder{};
  std::uint8_t buffer[4096];
  for (ssize_t n = 0; (n = ::read(line_, buffer, sizeof buffer)) > 0;)
    for (ssize_t i = 0; i < n; ++i) {
      TriggerFrame frame{};
      if (trigger_decode(&decoder, buffer[i], &frame) != trigger_frame_ready) continue;
      const std::lock_guard lock(mutex_);
      heard_.push_back(frame);
      heard_something_.notify_one();
    }
}

void QemuBoard::bytes(const Bytes& sent) { write_all(line_, sent.data(), sent.size()); }

std::uint8_t QemuBoard::send(std::uint8_t type, const Bytes& payload) {
  Bytes frame(trigger_max_frame);
  sequence_ = static_cast<std::uint8_t>((sequence_ + 1) % trigger_unasked);
  frame.resize(trigger_write_frame(type, sequence_, payload.data(), payload.size(), frame.data()));
  bytes(frame);
  return sequence_;
}

TriggerFrame QemuBoard::wait(const Predicate& requested) {
  std::unique_lock lock(mutex_);
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  for (;;) {
    while (looked_at_ < heard_.size()) {
      const TriggerFrame& f = heard_[looked_at_++];
      if (requested(f)) return f;
    }
    if (heard_something_.wait_until(lock, deadline) == std::cv_status::timeout)
      throw std::runtime_error("the board said nothing of the kind");
  }
}

TriggerFrame QemuBoard::ask(std::uint8_t type, const Bytes& payload) {
  const std::uint8_t sequence = send(type, payload);
  return wait([sequence](const TriggerFrame& f) { return f.sequence == sequence; });
}

std::vector<TriggerFrame> QemuBoard::drain() {
  const std::lock_guard lock(mutex_);
  std::vector<TriggerFrame> frames;
  while (looked_at_ < heard_.size()) frames.push_back(heard_[looked_at_++]);
  return frames;
}

}  // namespace vergence
