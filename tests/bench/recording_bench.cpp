/// Two cameras, 1280 × 960 at 30 Hz, not packed, with poses and an INS at 120 Hz, into a recording:
/// what is lost, what it costs the thread that posts, and the machine.
///
///   recording_bench [--out FOLDER] [--seconds 30] [--queue-mb 460]
/// FOLDER has to be empty, and room for 74 MB a second; without one it is a folder of the system's
/// for temporary files, and removed.
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "app/recording/messages.hpp"
#include "app/recording/recording.hpp"

namespace {

using namespace vergence;
using namespace vergence::app;
using Clock = std::chrono::steady_clock;

constexpr int kWidth = 1280, kHeight = 960, kRate = 30, kReadingsPerFrame = 4;
enum Topic : std::size_t { left, right, left_info, right_info, odometry, fix, reading };

struct Arguments {
  std::filesystem::path out;
  double seconds = 30;
  std::size_t queue_mb = 460;
};

/// Seconds on a processor of the threads of this name.
double cpu_seconds(const std::string& name) {
  double sum = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string comm;
    std::ifstream(task.path() / "comm") >> comm;
    double ns = 0;
    std::ifstream(task.path() / "schedstat") >> ns;
    if (comm == name) sum += ns * 1e-9;
  }
  return sum;
}

template <class Write>
void post(Recording* recording, Topic topic, Stamp stamp, std::size_t most, bool bulky,
          const Write& write) {
  const auto room = recording->begin(0, topic, stamp, most, bulky);
  if (room.empty()) return;
  CdrWriter out(room);
  write(&out);
  recording->commit(0, out.ok() ? out.size() : 0);
}

/// Images that are not in a cache when they are posted, as a camera's are not.
std::vector<std::vector<std::uint8_t>> images() {
  std::vector<std::vector<std::uint8_t>> out(16);
  std::uint32_t state = 1;
  for (auto& image : out) {
    image.resize(std::size_t{kWidth} * kHeight);
    for (auto& pixel : image) {
      state = state * 1664525U + 1013904223U;
      pixel = static_cast<std::uint8_t>(state >> 24U);
    }
  }
  return out;
}

void post_frame(Recording* recording, Stamp stamp, const ImageView& l, const ImageView& r) {
  RigCalibration rig;
  rig.cameras = 2;
  const std::size_t room = image_message_size(kWidth, kHeight, 5);
  post(recording, left, stamp, room, true, [&](CdrWriter* o) { write_image(o, stamp, "left", l); });
  post(recording, right, stamp, room, true,
       [&](CdrWriter* o) { write_image(o, stamp, "right", r); });
  post(recording, left_info, stamp, kMessageRoom, false,
       [&](CdrWriter* o) { write_camera_info(o, stamp, "left", rig, 0, false); });
  post(recording, right_info, stamp, kMessageRoom, false,
       [&](CdrWriter* o) { write_camera_info(o, stamp, "right", rig, 1, false); });
  post(recording, odometry, stamp, kMessageRoom, false,
       [&](CdrWriter* o) { write_odometry(o, {}); });
  for (int i = 0; i < kReadingsPerFrame; ++i) {
    post(recording, fix, stamp, kMessageRoom, false,
         [&](CdrWriter* o) { write_nav_sat_fix(o, {}); });
    post(recording, reading, stamp, kMessageRoom, false,
         [&](CdrWriter* o) { write_ins_reading(o, {}, {}); });
  }
}

int measure(const Arguments& a, const std::filesystem::path& folder) {
  Recording::Options options;
  options.files.topics = {{"/left/image_raw", RosType::image, false},
                          {"/right/image_raw", RosType::image, false},
                          {"/left/camera_info", RosType::camera_info, false},
                          {"/right/camera_info", RosType::camera_info, false},
                          {"/odometry", RosType::odometry, false},
                          {"/ins/fix", RosType::nav_sat_fix, false},
                          {"/ins/reading", RosType::ins_reading, false}};
  options.queues = {a.queue_mb << 20U};
  const auto pictures = images();
  Recording recording(folder, options);
  (void)pthread_setname_np(pthread_self(), "bench-post");
  std::vector<double> post_ms;
  const int frames = static_cast<int>(a.seconds * kRate);
  const auto begun = Clock::now();
  const double cpu_before = cpu_seconds("vergence-mcap"), own_before = cpu_seconds("bench-post");
  for (int i = 0; i < frames; ++i) {
    std::this_thread::sleep_until(begun + i * std::chrono::nanoseconds(1'000'000'000 / kRate));
    const auto& l = pictures[static_cast<std::size_t>(2 * i) % pictures.size()];
    const auto& r = pictures[static_cast<std::size_t>(2 * i + 1) % pictures.size()];
    const auto start = Clock::now();
    post_frame(&recording, Stamp(std::int64_t{i} * 1'000'000'000 / kRate),
               {l.data(), kWidth, kHeight, kWidth}, {r.data(), kWidth, kHeight, kWidth});
    post_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
  }
  const double writer = cpu_seconds("vergence-mcap") - cpu_before;
  const double poster = cpu_seconds("bench-post") - own_before;
  const double wall = std::chrono::duration<double>(Clock::now() - begun).count();
  recording.close();
  const RecordingCounters c = recording.counters();
  std::sort(post_ms.begin(), post_ms.end());
  std::printf("%d frames of 2 x %d x %d in %.1f s: %.1f MB/s\n", frames, kWidth, kHeight, wall,
              static_cast<double>(c.bytes) * 1e-6 / wall);
  std::printf("images dropped %llu, messages dropped %llu, lost %llu; chunks %llu\n",
              static_cast<unsigned long long>(c.dropped_images),
              static_cast<unsigned long long>(c.dropped), static_cast<unsigned long long>(c.lost),
              static_cast<unsigned long long>(c.chunks));
  std::printf("queue: %.0f MB, at most %.1f MB waited\n", static_cast<double>(c.queue_bytes) * 1e-6,
              static_cast<double>(c.queue_high_water) * 1e-6);
  std::printf("writer: %.1f %% of a core; posting: %.1f %%; both: %.1f %%\n", 100 * writer / wall,
              100 * poster / wall, 100 * (writer + poster) / wall);
  std::printf("posting a frame: median %.2f ms, p99 %.2f ms, most %.2f ms\n",
              post_ms[post_ms.size() / 2], post_ms[post_ms.size() * 99 / 100], post_ms.back());
  for (const std::string& sentence : recording.take_errors()) std::printf("%s\n", sentence.c_str());
  return c.dropped + c.lost == 0 ? 0 : 1;
}

Arguments parse(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--out") a.out = argv[i + 1];
    if (name == "--seconds") a.seconds = std::atof(argv[i + 1]);
    if (name == "--queue-mb") a.queue_mb = static_cast<std::size_t>(std::atoi(argv[i + 1]));
  }
  return a;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Arguments a = parse(argc, argv);
    if (!a.out.empty()) return measure(a, a.out);
    std::string name = (std::filesystem::temp_directory_path() / "recording-bench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) return 2;
    const int result = measure(a, name);
    std::filesystem::remove_all(name);
    return result;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "recording_bench: %s\n", e.what());
    return 2;
  }
}
