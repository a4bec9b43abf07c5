#include "app/datasets/detail/bag_scan.hpp"

#include <sqlite3.h>

#include <map>
#include <mutex>
#include <system_error>

#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

// The lower bits are the offset in a row's bytes, the upper ones the row.
constexpr unsigned kRowBits = 32;

/// File name as a URI of SQLite.
std::string to_uri(const std::filesystem::path& file) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(file).string())
    if (c == '%' || c == '?' || c == '#')
      uri += fmt::format("%{:02X}", c);
    else
      uri += c;
  // Without a write-ahead log no file next to it is needed, and none is written.
  std::error_code ignored;
  const auto log = std::filesystem::file_size(file.string() + "-wal", ignored);
  return uri + (ignored || log == 0 ? "?mode=ro&immutable=1" : "?mode=ro");
}

using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

/// Null if the database has no such tables.
Statement prepare(sqlite3* database, const char* sql) noexcept {
  sqlite3_stmt* statement = nullptr;
  (void)sqlite3_prepare_v2(database, sql, -1, &statement, nullptr);
  return {statement, sqlite3_finalize};
}

std::string text(const Statement& row, int column) {
  const auto* bytes = sqlite3_column_text(row.get(), column);
  return bytes == nullptr
             ? ""
             : std::string(reinterpret_cast<const char*>(bytes),
                           static_cast<std::size_t>(sqlite3_column_bytes(row.get(), column)));
}

/// ROS 2 bag in an SQLite file (.db3), opened read-only. A message's bytes have the offset row
/// number · 2^32, so that code which reads files by offset can read it.
class SqliteBag final : public ByteSource {
 public:
  /// Throws InputError if the file is missing or SQLite cannot open it. Also reads a write-ahead
  /// log (-wal) next to it.
  explicit SqliteBag(const std::filesystem::path& file) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored))
      refuse(file, 0, "is not a regular file; pass a bag");
    sqlite3* database = nullptr;
    const int status = sqlite3_open_v2(to_uri(file).c_str(), &database,
                                       SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
    database_.reset(database);
    if (status != SQLITE_OK)
      refuse(file, 0, std::string("cannot be opened by SQLite: ") + sqlite3_errstr(status));
    // The file is untrusted: its schema may not call functions, and no row is longer than a
    // message.
    (void)sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    (void)sqlite3_db_config(database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    (void)sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
    (void)sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
    (void)sqlite3_limit(database, SQLITE_LIMIT_LENGTH, static_cast<int>(2 * kMaxChunk));
  }

  [[nodiscard]] std::uint64_t size() const noexcept override { return std::uint64_t{1} << 63U; }
  [[nodiscard]] bool read(std::uint64_t offset,
                          std::span<std::uint8_t> out) const noexcept override {
    const std::uint64_t row = offset >> kRowBits;
    const auto at = static_cast<std::uint32_t>(offset);
    const std::lock_guard lock(mutex_);
    if (!blob_ || row != row_) {
      blob_.reset();
      sqlite3_blob* blob = nullptr;
      const int status = sqlite3_blob_open(database_.get(), "main", "messages", "data",
                                           static_cast<sqlite3_int64>(row), 0, &blob);
      blob_.reset(blob);
      row_ = row;
      if (status != SQLITE_OK) {
        blob_.reset();
        return false;
      }
    }
    const auto size = static_cast<std::uint32_t>(sqlite3_blob_bytes(blob_.get()));
    if (at > size || out.size() > size - at) return false;
    return sqlite3_blob_read(blob_.get(), out.data(), static_cast<int>(out.size()),
                             static_cast<int>(at)) == SQLITE_OK;
  }

  /// Same as scan_bag(). Empty if it is no SQLite file, or has no tables of a bag.
  [[nodiscard]] std::optional<BagScan> scan(const BagVisitor& each) const {
    constexpr std::int64_t kMaxRow = std::int64_t{1} << (62 - kRowBits);
    BagScan scan;
    std::map<std::int64_t, BagChannel> channels;
    const Statement topics =
        prepare(database_.get(), "SELECT id, name, type, serialization_format FROM topics");
    const Statement messages =
        prepare(database_.get(),
                "SELECT id, topic_id, timestamp, length(data), typeof(data) FROM messages "
                "ORDER BY timestamp, id");
    if (!topics || !messages) return std::nullopt;
    while (sqlite3_step(topics.get()) == SQLITE_ROW && channels.size() < kMaxChannels)
      if (std::string name = text(topics, 1); name.size() <= kMaxName)
        channels.try_emplace(
            sqlite3_column_int64(topics.get(), 0),
            BagChannel{std::move(name), plain_type(text(topics, 2)),
                       text(topics, 3) == "cdr" ? MessageEncoding::cdr : MessageEncoding::other});
    const auto integer = [&](int column) { return sqlite3_column_int64(messages.get(), column); };
    int status = SQLITE_ROW;
    while ((status = sqlite3_step(messages.get())) == SQLITE_ROW) {
      const std::int64_t row = integer(0), size = integer(3);
      const auto channel = channels.find(integer(1));
      if (channel == channels.end()) {
        ++scan.orphans;
      } else if (row <= 0 || row >= kMaxRow || size > static_cast<std::int64_t>(kMaxChunk) ||
                 text(messages, 4) != "blob") {
        scan.skip(0, "a row that is not a message, or is longer than 64 MiB");
      } else {
        ++scan.messages;
        each({&channel->second,
              {BagPlace::kNoChunk, static_cast<std::uint64_t>(row) << kRowBits,
               static_cast<std::uint32_t>(size)},
              this,
              integer(2)});
      }
    }
    scan.finished = true;
    if (status != SQLITE_DONE)
      scan.skip(0, std::string("where SQLite reports: ") + sqlite3_errstr(status));
    return scan;
  }

 private:
  struct Close {
    void operator()(sqlite3* database) const noexcept { sqlite3_close(database); }
    void operator()(sqlite3_blob* blob) const noexcept { sqlite3_blob_close(blob); }
  };

  std::unique_ptr<sqlite3, Close> database_;
  // Guards the members below and all accesses to the database.
  mutable std::mutex mutex_;
  mutable std::unique_ptr<sqlite3_blob, Close> blob_;
  // Row of the blob.
  mutable std::uint64_t row_ = 0;
};

}  // namespace

std::unique_ptr<const ByteSource> open_sqlite_bag(const std::filesystem::path& file) {
  return std::make_unique<SqliteBag>(file);
}

std::optional<BagScan> scan_sqlite(const ByteSource& file, const BagVisitor& each) {
  return dynamic_cast<const SqliteBag&>(file).scan(each);
}

}  // namespace vergence::app::detail
