#pragma once
#include <filesystem>
#include <memory>
#include <mutex>

#include "app/datasets/detail/bag_scan.hpp"

struct sqlite3;
struct sqlite3_blob;

namespace vergence::app::detail {

/// ROS 2 bag in an SQLite file (.db3), opened read-only. A message's bytes have the offset row
/// number · 2^32, so that code which reads files by offset can read it.
class SqliteBag final : public ByteSource {
 public:
  /// Throws InputError if the file is missing or SQLite cannot open it. Also reads a write-ahead
  /// log (-wal) next to it.
  explicit SqliteBag(const std::filesystem::path& file);
  ~SqliteBag() override;
  SqliteBag(const SqliteBag&) = delete;
  SqliteBag& operator=(const SqliteBag&) = delete;

  [[nodiscard]] std::uint64_t size() const noexcept override;
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override;
  /// Same as scan_bag(). Empty if it is no SQLite file, or has no tables of a bag.
  [[nodiscard]] std::optional<BagScan> scan(const BagVisitor& each) const;

 private:
  struct Close {
    void operator()(sqlite3* database) const noexcept;
    void operator()(sqlite3_blob* blob) const noexcept;
  };

  std::unique_ptr<sqlite3, Close> database_;
  // Guards the members below and all accesses to the database.
  mutable std::mutex mutex_;
  mutable std::unique_ptr<sqlite3_blob, Close> blob_;
  // Row of the blob.
  mutable std::uint64_t row_ = 0;
};

}  // namespace vergence::app::detail
