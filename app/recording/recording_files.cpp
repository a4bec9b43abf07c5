#include "app/recording/recording_files.hpp"

#include <climits>
#include <cstdio>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "app/runtime/errors.hpp"
#include "app/runtime/version.hpp"
#include "drivers/clock.hpp"

namespace vergence::app {
namespace {

/// Quality of service of a topic: reliable, and for latched topics transient local.
std::string qos(bool latched) {
  constexpr const char* kForever = "    sec: 2147483647\n    nsec: 4294967295\n";
  return fmt::format(
      "- history: 1\n  depth: {}\n  reliability: 1\n  durability: {}\n  deadline:\n{}  "
      "lifespan:\n{}"
      "  liveliness: 1\n  liveliness_lease_duration:\n{}  avoid_ros_namespace_conventions: false\n",
      latched ? 1 : 10, latched ? 1 : 2, kForever, kForever, kForever);
}

std::vector<McapTopic> described(const std::vector<RecordedTopic>& topics) {
  std::vector<McapTopic> out;
  out.reserve(topics.size());
  for (const RecordedTopic& t : topics)
    out.push_back(
        {t.name, std::string(ros_type_name(t.type)), ros_definition(t.type), qos(t.latched)});
  return out;
}

}  // namespace

RecordingFiles::RecordingFiles(const std::filesystem::path& folder, const Options& options)
    : folder_(folder.string()),
      roll_bytes_(options.roll_bytes),
      topics_(described(options.topics)),
      disk_(options.disk != nullptr ? *options.disk : system_disk()),
      file_(disk_, topics_, "vergence " + std::string(version())),
      path_(PATH_MAX),
      other_path_(PATH_MAX) {
  if (folder_.size() + 32 > PATH_MAX)
    throw InputError(folder_ + ": the path is too long for a recording; use a shorter one");
  for (const RecordingPreamble& p : options.preamble) {
    std::array<std::uint8_t, McapMessageHead::kSize> head{};
    McapMessageHead{static_cast<std::uint16_t>(p.topic + 1), 0, 0, p.message.size()}.write(head);
    preamble_.insert(preamble_.end(), head.begin(), head.end());
    preamble_.insert(preamble_.end(), p.message.begin(), p.message.end());
  }
  if (const int error = open(); error != 0)
    throw InputError(folder_ + ": the recording cannot be created (" + std::strerror(error) +
                     "); check the disk and the directory's permissions");
}

// ---- the writer

bool RecordingFiles::resting() const noexcept {
  return failing_ && monotonic_now().ns() < retry_ns_;
}

std::uint64_t RecordingFiles::append(Parts parts, std::uint64_t first,
                                     std::uint64_t lost) noexcept {
  if (!file_.open() && open() != 0) return 0;
  const std::uint64_t before = file_.size();
  int error = preamble_due_ ? write_preamble(first) : 0;
  if (error == 0) error = file_.write_chunk(parts);
  record_unwritten();
  if (error != 0) {
    fail(-error);
    return 0;
  }
  if (std::exchange(failing_, false))
    (void)notices_.push({Notice::Kind::good_again, 0, lost, number_});
  return file_.size() - before;
}

void RecordingFiles::finish(std::uint64_t time) noexcept {
  if (file_.open() && preamble_due_) (void)write_preamble(time);
  end_file();
}

void RecordingFiles::end_file() noexcept {
  const int error = file_.finish();
  record_unwritten();
  if (error != 0) (void)notices_.push({Notice::Kind::unfinished, -error, 0, number_});
}

/// The data are not written again, because the system no longer has them.
void RecordingFiles::record_unwritten() noexcept {
  const McapFile::Unwritten missing = file_.pop_unwritten();
  if (missing.messages == 0) return;
  unwritten_.fetch_add(missing.messages, std::memory_order_relaxed);
  (void)notices_.push({Notice::Kind::unwritten, -missing.error, missing.messages, number_});
}

int RecordingFiles::open() noexcept {
  if (const int error = file_.create(path(&path_)); error != 0) {
    fail(-error);
    return -error;
  }
  files_.fetch_add(1, std::memory_order_relaxed);
  preamble_due_ = !preamble_.empty();
  return 0;
}

/// Writes the preamble before the first chunk of a file, with that chunk's time. Returns 0 or an
/// error.
int RecordingFiles::write_preamble(std::uint64_t time) noexcept {
  for (std::span<std::uint8_t> rest(preamble_); !rest.empty();) {
    McapMessageHead head = McapMessageHead::read(rest.first<McapMessageHead::kSize>());
    head.log_time = time;
    head.write(rest.first<McapMessageHead::kSize>());
    rest = rest.subspan(head.record_size());
  }
  const std::array<std::span<const std::uint8_t>, 1> part{preamble_};
  const int error = file_.write_chunk(part);
  preamble_due_ = error != 0;
  return error;
}

void RecordingFiles::fail(int error) noexcept {
  if (!std::exchange(failing_, true))
    (void)notices_.push({Notice::Kind::failed, error, 0, number_});
  retry_ns_ = (monotonic_now() + kRetry).ns();
}

void RecordingFiles::roll() noexcept {
  if (!file_.full() && (roll_bytes_ == 0 || file_.size() < roll_bytes_)) return;
  end_file();
  begin_next_number();
}

void RecordingFiles::begin_next_number() noexcept {
  if (number_ == 0) {
    const char* only = path(&path_);
    several_ = true;
    (void)disk_.rename(only, path(&other_path_));
  }
  ++number_;
}

const char* RecordingFiles::path(std::vector<char>* out) const noexcept {
  if (several_)
    (void)std::snprintf(out->data(), out->size(), "%s/drive_%d.mcap", folder_.c_str(), number_);
  else
    (void)std::snprintf(out->data(), out->size(), "%s/drive.mcap", folder_.c_str());
  return out->data();
}

// ---- any thread

std::vector<std::string> RecordingFiles::pop_errors() {
  const std::lock_guard lock(errors_mutex_);
  std::vector<std::string> out;
  for (Notice n; notices_.pop(&n);) out.push_back(message(n));
  return out;
}

std::string RecordingFiles::message(const Notice& n) const {
  const std::string what = std::strerror(n.error);
  switch (n.kind) {
    case Notice::Kind::good_again:
      return fmt::format("{}: the recording is written again; {} messages were lost", folder_,
                         n.lost);
    case Notice::Kind::failed:
      return fmt::format(
          "{}: the recording cannot be written ({}); the session continues, writing is retried "
          "every {:.0f} s, and messages that do not fit into memory are lost: check the disk",
          folder_, what, kRetry.to_seconds());
    case Notice::Kind::unfinished:
      return fmt::format(
          "{}: file {} of the recording has no summary ({}); it can be read without one, up to its "
          "last chunk",
          folder_, n.file, what);
    case Notice::Kind::unwritten:
      return fmt::format(
          "{}: the disk lost data that it had accepted ({}): {} messages of file {} of the "
          "recording are lost; check the disk",
          folder_, what, n.lost, n.file);
  }
  return {};
}

}  // namespace vergence::app
