#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

namespace vergence::test {

/// A satellite receiver behind a pseudo-terminal: an epoch every 100 ms of the real clock, while it
/// is on.
///
/// Threads  `epoch` is called on one of its own, from construction to destruction.
class Receiver {
 public:
  using Epoch = std::function<std::string(int number)>;
  explicit Receiver(Epoch epoch) : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    EXPECT_TRUE(master_ >= 0 && ::grantpt(master_) == 0 && ::unlockpt(master_) == 0);
    port_ = ::ptsname(master_);
    thread_ = std::thread([this, epoch = std::move(epoch)] {
      for (int i = 0; !ended_; ++i) {
        const std::string bytes = epoch(i);
        if (on_ && ::write(master_, bytes.data(), bytes.size()) < 0) {
          // Nobody reads yet: a receiver does not care.
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    });
  }
  ~Receiver() {
    ended_ = true;
    thread_.join();
    ::close(master_);
  }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;
  [[nodiscard]] const std::string& port() const { return port_; }
  void turn(bool on) { on_ = on; }

 private:
  int master_;
  std::string port_;
  std::atomic<bool> ended_{false}, on_{true};
  std::thread thread_;
};

}  // namespace vergence::test
