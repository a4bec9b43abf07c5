#pragma once
#include <sys/mount.h>

#include <filesystem>
#include <string>

namespace vergence::test {

/// A file system of its own, in memory, on a folder that is there, until the object goes. Root may
/// mount one; others are told by ready().
class SmallDisk {
 public:
  /// `options`: as `mount -o` of a tmpfs: `nr_inodes=1` has no room for any file or folder.
  SmallDisk(const std::filesystem::path& at, const std::string& options)
      : at_(at), ready_(::mount("none", at.c_str(), "tmpfs", 0, options.c_str()) == 0) {}
  ~SmallDisk() {
    if (ready_) (void)::umount2(at_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] bool change(const std::string& options) const {
    return ::mount("none", at_.c_str(), "tmpfs", MS_REMOUNT, options.c_str()) == 0;
  }
  [[nodiscard]] bool make_read_only() const {
    return ::mount("none", at_.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, nullptr) == 0;
  }

 private:
  std::filesystem::path at_;
  bool ready_;
};

}  // namespace vergence::test
