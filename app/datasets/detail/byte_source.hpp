#pragma once
#include <cstdint>
#include <filesystem>
#include <span>

namespace vergence::app::detail {

/// Bytes with random access. read() is thread-safe.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const noexcept = 0;
  /// Fills `out` from `offset`. Returns false, with `out` undefined, if that fails.
  [[nodiscard]] virtual bool read(std::uint64_t offset,
                                  std::span<std::uint8_t> out) const noexcept = 0;
};

/// File among more than a process may have open: each thread keeps only its last file open.
class FileBytes final : public ByteSource {
 public:
  /// Throws InputError if the file is missing, not regular or cannot be opened.
  explicit FileBytes(const std::filesystem::path& file);
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;
  [[nodiscard]] std::uint64_t size() const noexcept override { return size_; }
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  // Unique in the process.
  std::uint64_t number_;
  std::uint64_t size_ = 0;
};

/// View of bytes, which must outlive it.
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
