#pragma once
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "app/datasets/detail/bag_scan.hpp"

struct sqlite3;
struct sqlite3_blob;

namespace vergence::app::detail {

/// A bag of ROS 2 in an SQLite file (.db3), opened for reading only. A message's bytes are at the
/// number of its row times 2^32: what reads files by position reads it as one.
class SqliteBag final : public ByteSource {
 public:
  /// InputError: no such file, or SQLite cannot open it. A log of writes beside it (-wal) is read,
  /// too.
  explicit SqliteBag(const std::filesystem::path& file);
  /// Reads the bag from a file's bytes.
  explicit SqliteBag(std::vector<std::uint8_t> bytes);
  ~SqliteBag() override;
  SqliteBag(const SqliteBag&) = delete;
  SqliteBag& operator=(const SqliteBag&) = delete;

  [[nodiscard]] std::uint64_t size() const noexcept override;
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override;
  /// As scan_bag(). Nothing: it is no SQLite file, or has no tables of a bag.
  [[nodiscard]] std::optional<BagScan> scan(const BagVisitor& each) const;

 private:
  struct Close {
    void operator()(sqlite3* database) const noexcept;
    void operator()(sqlite3_blob* blob) const noexcept;
  };
  void harden() const noexcept;

  std::vector<std::uint8_t> bytes_;
  std::unique_ptr<sqlite3, Close> database_;
  mutable std::mutex mutex_;  // with what follows, and all uses of the database
  mutable std::unique_ptr<sqlite3_blob, Close> blob_;
  mutable std::uint64_t row_ = 0;  // of the blob
};

}  // namespace vergence::app::detail
