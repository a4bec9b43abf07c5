#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "app/config/detail/schema_groups.hpp"

namespace vergence::app::groups {

Group general() {
  Group group;
  group.meaning = "Keys that belong to no group.";
  group.keys.push_back(
      {"threads", KeyType::integer, "", 1, 2,
       "Threads of the estimator: with 2 the second image is searched and tracked beside the "
       "first; the poses are the same.",
       [](Configuration& c, const KeyValue& v) {
         c.threads = static_cast<int>(std::get<std::int64_t>(v));
       },
       [](const Configuration& c) -> KeyValue { return std::int64_t{c.threads}; }});
  return group;
}

Group kitti_raw() {
  using K = KittiRawSettings;
  return Rows<K>(
             "kitti_raw", "Replays of KITTI raw drives.",
             [](auto& c) -> auto& { return c.kitti_raw; })
      .integer("left", &K::left, 0, 3, "", "Left camera of a drive, `image_NN`: 0 grey, 2 colour.")
      .integer("right", &K::right, 0, 3, "", "Right camera: 1 grey, 3 colour.")
      .done();
}

Group record() {
  using R = RecordSettings;
  const std::vector<std::string> off_on{"off", "on"};
  return Rows<R>(
             "record",
             "What is recorded into `drive.mcap` of the session (docs/recording.md). A list, "
             "`record: [poses, ins, images]`, switches its words on.",
             [](auto& c) -> auto& { return c.record; })
      .choice("poses", &R::poses, off_on, "Odometry, transforms and diagnostics of every frame.")
      .choice("ins", &R::ins, off_on, "All readings of the INS, as they were compared.")
      .choice("images", &R::images, off_on,
              "All images that the estimator was given, with their cameras: what `replay --format "
              "session` needs.")
      .choice("pulses", &R::pulses, off_on, "The trigger board's pulses of a live run.")
      .number("keep_s", &R::keep_s, 0, 3600, "s",
              "0: everything; else only what was so long before an event and so long after it.")
      .integer("roll_mb", &R::roll_mb, 0, 10'000'000, "MB",
               "Size at which a file ends and the next one begins; 0: one file.")
      .done();
}

Group publish() {
  using P = PublishSettings;
  return Rows<P>(
             "publish", "What others see of a running session, live or replayed (docs/publish.md).",
             [](auto& c) -> auto& { return c.publish; })
      .text("lines", &P::lines, 200,
            "One JSON object a frame goes there: `unix:///PATH` (a stream socket that readers "
            "connect to) or `udp://HOST:PORT`; empty: nowhere.")
      .text("http", &P::http, 200,
            "HOST:PORT of the live page, e.g. `127.0.0.1:8080`; beyond this machine viewers need "
            "the token. Empty: no page.")
      .text("token_file", &P::token_file, 400,
            "File whose first line is the page's token, 16 to 128 letters and digits; empty: a "
            "new one each session, shown when it starts.")
      .integer("viewers", &P::viewers, 1, 16, "viewers", "So many may look at the page at a time.")
      .done();
}

Group realtime() {
  using R = RealtimeSettings;
  return Rows<R>(
             "realtime",
             "Scheduling and memory of the threads of a drive (docs/realtime.md). What the system "
             "refuses is said, and the drive goes on.",
             [](auto& c) -> auto& { return c.realtime; })
      .integer("priority", &R::priority, 0, 90, "",
               "SCHED_FIFO priority of the threads of cameras, trigger and synchroniser; the "
               "estimator has one less, the INS two, files three, the solver none. 0: no thread "
               "has one.")
      .text("affinity", &R::affinity, 64,
            "Processors of these threads, as taskset has them: `0-1,3`. Empty: any.")
      .text("solver_affinity", &R::solver_affinity, 64,
            "Processors of the calibration solver. Empty: any.")
      .choice("lock_memory", &R::lock_memory, {"off", "on"},
              "`on`: memory is locked before the first frame (mlockall), so that none of it is "
              "ever fetched from a disk.")
      .number("frame_budget_ms", &R::frame_budget_ms, 0, 10000, "ms",
              "What the estimator may take for a frame of a live drive before it leaves out work "
              "that the pose does not wait for. 0: the frame interval.")
      .done();
}

}  // namespace vergence::app::groups
