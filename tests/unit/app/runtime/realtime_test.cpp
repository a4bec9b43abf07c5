#include "app/runtime/realtime.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <map>
#include <string>
#include <thread>
#include <vector>

namespace vergence::app {
namespace {

/// A system that remembers what it was asked for and refuses what it is told to.
class FakeSystem final : public RealtimeSystem {
 public:
  int set_fifo(pid_t thread, int priority) override {
    ++calls;
    if (fifo_error == 0) priorities[thread] = priority;
    return fifo_error;
  }
  int lock_memory(Locked* locked) override {
    ++locks;
    *locked = covers;
    return lock_error;
  }

  int fifo_error = 0, lock_error = 0, calls = 0, locks = 0;
  Locked covers = Locked::everything;
  std::map<pid_t, int> priorities;
};

const std::vector<ProcessThread> kDrive{
    {1, "vergence"},        {2, "vergence-gige"},  {3, "vergence-estim"}, {4, "vergence-ins"},
    {5, "vergence-record"}, {6, "vergence-calib"}, {7, "vergence-mock"},  {8, "gmain"}};

bool mentions(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Realtime, urgentRolesHaveHigherPriority) {
  FakeSystem system;
  RealtimeThreads threads(40, system);
  EXPECT_TRUE(threads.apply(kDrive).empty());
  const std::map<pid_t, int> expected{{2, 40}, {3, 39}, {4, 38}, {5, 37}};
  EXPECT_EQ(system.priorities, expected) << "solver, mock, caller and libraries stay as they are";
}

TEST(Realtime, eachThreadIsSetOnce) {
  FakeSystem system;
  RealtimeThreads threads(40, system);
  (void)threads.apply(kDrive);
  EXPECT_EQ(system.calls, 4);
  (void)threads.apply(kDrive);
  EXPECT_EQ(system.calls, 4);
  std::vector<ProcessThread> later = kDrive;
  later.push_back({9, "vergence-v4l2"});
  (void)threads.apply(later);
  EXPECT_EQ(system.calls, 5);
  EXPECT_EQ(system.priorities[9], 40);
}

TEST(Realtime, refusalIsOneMessageWithTheFix) {
  FakeSystem system;
  system.fifo_error = EPERM;
  system.lock_error = ENOMEM;
  RealtimeThreads threads(40, system);
  const auto memory = threads.lock_memory();
  ASSERT_EQ(memory.size(), 1U);
  EXPECT_TRUE(mentions(memory[0], "LimitMEMLOCK") && mentions(memory[0], "ulimit -l")) << memory[0];
  const auto messages = threads.apply(kDrive);
  ASSERT_EQ(messages.size(), 1U) << "one message, however many threads there are";
  EXPECT_TRUE(mentions(messages[0], "setcap") && mentions(messages[0], "LimitRTPRIO=40"))
      << messages[0];
  EXPECT_TRUE(threads.apply({{20, "vergence-v4l2"}}).empty());
}

/// The kernel itself: a thread of this test is found by its name and gets what was asked for.
TEST(Realtime, kernelSchedulesAsRequested) {
  std::atomic<pid_t> id{0};
  std::atomic<bool> stop{false};
  std::thread worker([&] {
    (void)pthread_setname_np(pthread_self(), "vergence-estim");
    id = ::gettid();
    id.notify_one();
    stop.wait(false);
  });
  id.wait(0);
  RealtimeSystem system;
  RealtimeThreads threads(10, system);
  std::vector<ProcessThread> all;
  process_threads(&all);
  const auto messages = threads.apply(all);
  sched_param parameter{};
  const int policy = ::sched_getscheduler(id);
  EXPECT_EQ(::sched_getparam(id, &parameter), 0);
  stop = true;
  stop.notify_one();
  worker.join();
  if (!messages.empty()) GTEST_SKIP() << "no real-time priority is allowed here: " << messages[0];
  EXPECT_EQ(policy, SCHED_FIFO | SCHED_RESET_ON_FORK);
  EXPECT_EQ(parameter.sched_priority, 9);
}

}  // namespace
}  // namespace vergence::app
