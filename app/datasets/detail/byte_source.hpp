#pragma once
#include <cstdint>
#include <filesystem>
#include <span>

namespace vergence::app::detail {

/// Bytes that are read by position. Threads  read() from any number at once.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const noexcept = 0;
  /// All of `out` from `offset`. False: they are not all there, or cannot be read; content of `out`
  /// undefined.
  [[nodiscard]] virtual bool read(std::uint64_t offset,
                                  std::span<std::uint8_t> out) const noexcept = 0;
};

/// A file of which there may be more than a process may have open: each thread keeps the one that
/// it read last open.
class FileBytes final : public ByteSource {
 public:
  /// InputError: no such file, no regular file, or it cannot be opened.
  explicit FileBytes(const std::filesystem::path& file);
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;
  [[nodiscard]] std::uint64_t size() const noexcept override { return size_; }
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  std::uint64_t number_;  // no other one of the process has it
  std::uint64_t size_ = 0;
};

/// A view; the bytes outlive it.
class MemoryBytes final : public ByteSource {
 public:
  explicit MemoryBytes(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}
  [[nodiscard]] std::uint64_t size() const noexcept override { return bytes_.size(); }
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override;

 private:
  std::span<const std::uint8_t> bytes_;
};

}  // namespace vergence::app::detail
