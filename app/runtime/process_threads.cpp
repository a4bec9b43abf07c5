#include "app/runtime/process_threads.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace vergence::app {

std::vector<ProcessThread> process_threads() {
  namespace fs = std::filesystem;
  std::vector<ProcessThread> threads;
  std::error_code error;
  fs::directory_iterator entry("/proc/self/task", error);
  while (!error && entry != fs::directory_iterator()) {
    ProcessThread thread;
    thread.id = static_cast<pid_t>(std::atoi(entry->path().filename().c_str()));
    std::ifstream comm(entry->path() / "comm");
    if (thread.id > 0 && std::getline(comm, thread.name)) threads.push_back(std::move(thread));
    entry.increment(error);  // a thread that ends meanwhile is no error
  }
  return threads;
}

}  // namespace vergence::app
