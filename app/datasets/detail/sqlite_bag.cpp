#include "app/datasets/detail/sqlite_bag.hpp"

#include <sqlite3.h>

#include <map>
#include <string>
#include <system_error>

#include <fmt/format.h>

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

class Statement {
 public:
  Statement(sqlite3* database, const char* sql) noexcept {
    if (sqlite3_prepare_v2(database, sql, -1, &statement_, nullptr) != SQLITE_OK)
      statement_ = nullptr;
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  [[nodiscard]] bool ok() const noexcept { return statement_ != nullptr; }
  /// Returns SQLITE_ROW, SQLITE_DONE or an error.
  [[nodiscard]] int step() noexcept { return sqlite3_step(statement_); }
  [[nodiscard]] std::int64_t integer(int column) noexcept {
    return sqlite3_column_int64(statement_, column);
  }
  [[nodiscard]] std::string text(int column) {
    const auto* bytes = sqlite3_column_text(statement_, column);
    const int size = sqlite3_column_bytes(statement_, column);
    return bytes == nullptr
               ? std::string()
               : std::string(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size));
  }

 private:
  sqlite3_stmt* statement_ = nullptr;
};

}  // namespace

void SqliteBag::Close::operator()(sqlite3* database) const noexcept { sqlite3_close(database); }
void SqliteBag::Close::operator()(sqlite3_blob* blob) const noexcept { sqlite3_blob_close(blob); }

SqliteBag::SqliteBag(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    refuse(file, 0, "is not a regular file; pass a bag");
  sqlite3* database = nullptr;
  const int status = sqlite3_open_v2(to_uri(file).c_str(), &database,
                                     SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
  database_.reset(database);
  if (status != SQLITE_OK)
    refuse(file, 0, std::string("cannot be opened by SQLite: ") + sqlite3_errstr(status));
  // The file is untrusted: its schema may not call functions, and no row is longer than a message.
  (void)sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  (void)sqlite3_db_config(database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  (void)sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  (void)sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  (void)sqlite3_limit(database, SQLITE_LIMIT_LENGTH, static_cast<int>(2 * kMaxChunk));
}

SqliteBag::~SqliteBag() = default;

std::uint64_t SqliteBag::size() const noexcept { return std::uint64_t{1} << 63U; }

bool SqliteBag::read(std::uint64_t offset, std::span<std::uint8_t> out) const noexcept {
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

std::optional<BagScan> SqliteBag::scan(const BagVisitor& each) const {
  constexpr std::int64_t kMaxRow = std::int64_t{1} << (62 - kRowBits);
  BagScan scan;
  std::map<std::int64_t, BagChannel> channels;
  {
    Statement topics(database_.get(), "SELECT id, name, type, serialization_format FROM topics");
    if (!topics.ok()) return std::nullopt;
    while (topics.step() == SQLITE_ROW && channels.size() < kMaxChannels)
      if (std::string name = topics.text(1); name.size() <= kMaxName)
        channels.try_emplace(
            topics.integer(0),
            BagChannel{std::move(name), plain_type(topics.text(2)),
                       topics.text(3) == "cdr" ? MessageEncoding::cdr : MessageEncoding::other});
  }
  Statement messages(database_.get(),
                     "SELECT id, topic_id, timestamp, length(data), typeof(data) FROM messages "
                     "ORDER BY timestamp, id");
  if (!messages.ok()) return std::nullopt;
  int status = SQLITE_ROW;
  while ((status = messages.step()) == SQLITE_ROW) {
    const std::int64_t row = messages.integer(0), size = messages.integer(3);
    const auto channel = channels.find(messages.integer(1));
    if (channel == channels.end()) {
      ++scan.orphans;
    } else if (row <= 0 || row >= kMaxRow || size > static_cast<std::int64_t>(kMaxChunk) ||
               messages.text(4) != "blob") {
      scan.skip(0, "a row that is not a message, or is longer than 64 MiB");
    } else {
      ++scan.messages;
      each({&channel->second,
            {BagPlace::kNoChunk, static_cast<std::uint64_t>(row) << kRowBits,
             static_cast<std::uint32_t>(size)},
            this,
            messages.integer(2)});
    }
  }
  scan.finished = true;
  if (status != SQLITE_DONE)
    scan.skip(0, std::string("where SQLite reports: ") + sqlite3_errstr(status));
  return scan;
}

}  // namespace vergence::app::detail
