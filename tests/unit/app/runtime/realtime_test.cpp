#include "app/runtime/realtime.hpp"
#include "tests/support/mentions.hpp"

#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <thread>

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
  int set_affinity(pid_t thread, const cpu_set_t& cpus) override {
    if (affinity_error == 0) processors[thread] = CPU_COUNT(&cpus);
    return affinity_error;
  }
  int lock_memory(Locked* locked) override {
    ++locks;
    *locked = covers;
    return lock_error;
  }

  int fifo_error = 0, affinity_error = 0, lock_error = 0, calls = 0, locks = 0;
  Locked covers = Locked::everything;
  std::map<pid_t, int> priorities, processors;
};

const std::vector<ProcessThread> kDrive{
    {1, "vergence"},        {2, "vergence-gige"},  {3, "vergence-estim"}, {4, "vergence-ins"},
    {5, "vergence-record"}, {6, "vergence-calib"}, {7, "vergence-mock"},  {8, "gmain"}};

TEST(Realtime, urgentRolesHaveHigherPriority) {
  FakeSystem system;
  RealtimeThreads threads({.priority = 40}, system);
  EXPECT_TRUE(threads.apply(kDrive).empty());
  const std::map<pid_t, int> expected{{2, 40}, {3, 39}, {4, 38}, {5, 37}};
  EXPECT_EQ(system.priorities, expected) << "solver, mock, caller and libraries stay as they are";
}

TEST(Realtime, eachThreadIsSetOnce) {
  FakeSystem system;
  RealtimeThreads threads({.priority = 40}, system);
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
  system.affinity_error = EINVAL;
  system.lock_error = ENOMEM;
  RealtimeSettings request{.priority = 40, .affinity = "900", .lock_memory = 1};
  RealtimeThreads threads(request, system);
  const auto memory = threads.lock_memory();
  ASSERT_EQ(memory.size(), 1U);
  EXPECT_TRUE(test::mentions(memory[0], "LimitMEMLOCK", "ulimit -l"));
  const auto messages = threads.apply(kDrive);
  ASSERT_EQ(messages.size(), 2U) << "one for each key, however many threads there are";
  EXPECT_TRUE(test::mentions(messages[0], "realtime.affinity"));
  EXPECT_TRUE(test::mentions(messages[1], "setcap", "LimitRTPRIO=40"));
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
  cpu_set_t here;
  CPU_ZERO(&here);
  ASSERT_EQ(::sched_getaffinity(0, sizeof(here), &here), 0);
  unsigned first = 0;
  while (!CPU_ISSET(first, &here)) ++first;
  RealtimeSettings request{.priority = 10, .affinity = std::to_string(first)};
  RealtimeSystem system;
  RealtimeThreads threads(request, system);
  std::vector<ProcessThread> all;
  process_threads(&all);
  const auto messages = threads.apply(all);
  sched_param parameter{};
  const int policy = ::sched_getscheduler(id);
  EXPECT_EQ(::sched_getparam(id, &parameter), 0);
  cpu_set_t set;
  CPU_ZERO(&set);
  EXPECT_EQ(::sched_getaffinity(id, sizeof(set), &set), 0);
  stop = true;
  stop.notify_one();
  worker.join();
  EXPECT_EQ(CPU_COUNT(&set), 1);
  EXPECT_TRUE(CPU_ISSET(first, &set));
  if (!messages.empty())
    GTEST_SKIP() << "needs the permission for a real-time priority: " << messages[0];
  EXPECT_EQ(policy, SCHED_FIFO | SCHED_RESET_ON_FORK);
  EXPECT_EQ(parameter.sched_priority, 9);
}

TEST(CpuList, readsTasksetLists) {
  const auto count = [](const char* text) {
    const auto set = parse_cpu_list(text);
    return set ? CPU_COUNT(&*set) : -1;
  };
  EXPECT_EQ(count("0"), 1);
  EXPECT_EQ(count("0-1,3"), 3);
  EXPECT_EQ(count("2,2"), 1);
  for (const char* bad : {"", ",", "1,", "3-1", "-1", "1-", "a", "1 2", "1024", "99999999999"})
    EXPECT_EQ(count(bad), -1) << bad;
}

}  // namespace
}  // namespace vergence::app
