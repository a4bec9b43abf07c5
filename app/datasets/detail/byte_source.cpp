#include "app/datasets/detail/byte_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <list>
#include <memory>
#include <mutex>
#include <new>

#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

class Descriptor {
 public:
  explicit Descriptor(const std::filesystem::path& file) noexcept
      : fd_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int fd() const noexcept { return fd_; }

 private:
  const int fd_;
};

/// Those in use, the one read last in front. What is pushed out while a thread reads it is closed
/// after that.
class OpenFiles {
 public:
  using Open = std::shared_ptr<const Descriptor>;

  /// → nullptr: it cannot be opened.
  [[nodiscard]] Open get(std::uint64_t number, const std::filesystem::path& file) {
    const std::lock_guard lock(mutex_);
    const auto found = find(number);
    if (found != files_.end()) {
      files_.splice(files_.begin(), files_, found);
      return files_.front().open;
    }
    auto open = std::make_shared<const Descriptor>(file);
    if (open->fd() < 0) return nullptr;
    files_.push_front({number, open});
    if (files_.size() > FileBytes::kMostOpen) files_.pop_back();
    return open;
  }
  void close(std::uint64_t number) noexcept {
    const std::lock_guard lock(mutex_);
    if (const auto found = find(number); found != files_.end()) files_.erase(found);
  }

 private:
  struct File {
    std::uint64_t number;
    Open open;
  };
  [[nodiscard]] std::list<File>::iterator find(std::uint64_t number) {
    return std::find_if(files_.begin(), files_.end(),
                        [number](const File& f) { return f.number == number; });
  }

  std::mutex mutex_;
  std::list<File> files_;
};

OpenFiles& open_files() {
  static OpenFiles files;
  return files;
}

std::uint64_t next_number() noexcept {
  static std::atomic<std::uint64_t> number{0};
  return number.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

FileBytes::FileBytes(const std::filesystem::path& file) : path_(file), number_(next_number()) {
  const OpenFiles::Open open = open_files().get(number_, path_);
  if (open == nullptr) refuse(file, 0, std::string("cannot be opened: ") + std::strerror(errno));
  struct stat about {};
  if (::fstat(open->fd(), &about) != 0 || !S_ISREG(about.st_mode)) {
    open_files().close(number_);
    refuse(file, 0, "is no regular file; a bag is expected");
  }
  size_ = static_cast<std::uint64_t>(about.st_size);
}

FileBytes::~FileBytes() { open_files().close(number_); }

bool FileBytes::read(std::uint64_t offset, std::span<std::uint8_t> out) const noexcept try {
  if (offset > size_ || out.size() > size_ - offset) return false;
  const OpenFiles::Open open = open_files().get(number_, path_);
  if (open == nullptr) return false;
  for (std::size_t got = 0; got < out.size();) {
    const ssize_t n =
        ::pread(open->fd(), out.data() + got, out.size() - got, static_cast<off_t>(offset + got));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    got += static_cast<std::size_t>(n);
  }
  return true;
} catch (const std::bad_alloc&) {
  return false;
}

bool MemoryBytes::read(std::uint64_t offset, std::span<std::uint8_t> out) const noexcept {
  if (offset > bytes_.size() || out.size() > bytes_.size() - offset) return false;
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
  return true;
}

}  // namespace vergence::app::detail
