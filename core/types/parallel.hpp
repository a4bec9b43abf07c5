#pragma once
#include <type_traits>
#include <utility>

namespace vergence {

/// A borrowed callable without arguments; no heap. The callable outlives the reference.
class TaskRef {
 public:
  template <class F>
  requires(!std::is_same_v<std::remove_cvref_t<F>, TaskRef>) explicit TaskRef(F& f) noexcept
      : object_(&f), call_([](void* o) noexcept { (*static_cast<F*>(o))(); }) {}
  void operator()() const noexcept { call_(object_); }

 private:
  void* object_;
  void (*call_)(void*) noexcept;
};

/// Runs two independent tasks and returns when both are done. The core owns no threads: the app hands one in.
///
/// Threads  Called from the estimator's thread only. Tasks share nothing they write.
/// Errors   None; tasks are noexcept.
class PairRunner {
 public:
  virtual ~PairRunner() = default;
  virtual void run(TaskRef here, TaskRef there) noexcept = 0;
};

/// One after the other on the caller's thread. Same results by construction of the tasks.
class SequentialRunner final : public PairRunner {
 public:
  void run(TaskRef here, TaskRef there) noexcept override {
    here();
    there();
  }
};

}  // namespace vergence
