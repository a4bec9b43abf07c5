#include "app/recording/mcap_file.hpp"

#include <fcntl.h>
#include <libdeflate.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>

namespace vergence::app {

namespace {

/// Errors that mean "not supported" (a pipe, an old file system), not data loss.
bool cannot_write_back(int error) noexcept {
  return error == ESPIPE || error == EINVAL || error == ENOSYS;
}

constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'M', 'C', 'A', 'P', 0x30, '\r', '\n'};
// Opcode u8, length u64.
constexpr std::size_t kRecordHead = 9;
// Start, end and size u64, checksum u32, empty compression u32, size u64.
constexpr std::size_t kChunkHead = kRecordHead + 40;
constexpr std::size_t kScratch = std::size_t{256} << 10;

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  summary_offset = 0x0E,
  data_end = 0x0F
};

/// Writes a record whose length is determined by its content.
template <class Content>
void put_record(ByteWriter* out, Opcode opcode, const Content& content) noexcept {
  out->put(static_cast<std::uint8_t>(opcode));
  const std::size_t length_at = out->size();
  out->put(std::uint64_t{0});
  content(out);
  out->overwrite(length_at, static_cast<std::uint64_t>(out->size() - length_at - 8));
}

}  // namespace

int Disk::create(const char* path) noexcept {
  const int fd = ::open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  return fd < 0 ? -errno : fd;
}

std::int64_t Disk::write(int fd, const iovec* pieces, int count, std::uint64_t offset) noexcept {
  for (;;) {
    const ssize_t n = ::pwritev(fd, pieces, count, static_cast<off_t>(offset));
    if (n > 0) return n;
    if (n == 0) return -ENOSPC;
    if (errno != EINTR) return -errno;
  }
}

int Disk::finish_writeback(int fd, std::uint64_t offset, std::uint64_t size) noexcept {
  const int done = ::sync_file_range(
      fd, static_cast<off64_t>(offset), static_cast<off64_t>(size),
      SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE | SYNC_FILE_RANGE_WAIT_AFTER);
  const int error = done == 0 || cannot_write_back(errno) ? 0 : -errno;
  (void)::posix_fadvise(fd, static_cast<off_t>(offset), static_cast<off_t>(size),
                        POSIX_FADV_DONTNEED);
  return error;
}

int Disk::synchronise(int fd) noexcept {
  return ::fdatasync(fd) == 0 || errno == EINVAL ? 0 : -errno;
}

void McapMessageHead::write(std::span<std::uint8_t, kSize> out) const noexcept {
  ByteWriter w(out);
  w.put(static_cast<std::uint8_t>(Opcode::message));
  w.put(static_cast<std::uint64_t>(kSize - kRecordHead) + content);
  // The publish time equals the time of measurement.
  w.put(channel).put(sequence).put(log_time).put(log_time);
}

McapMessageHead McapMessageHead::read(std::span<const std::uint8_t, kSize> in) noexcept {
  McapMessageHead head;
  std::uint64_t length = 0;
  std::memcpy(&length, &in[1], sizeof length);
  std::memcpy(&head.channel, &in[9], sizeof head.channel);
  std::memcpy(&head.sequence, &in[11], sizeof head.sequence);
  std::memcpy(&head.log_time, &in[15], sizeof head.log_time);
  head.content = length - (kSize - kRecordHead);
  return head;
}

/// Appends small records through a buffer, with the checksum of a summary.
class McapFile::Appender {
 public:
  explicit Appender(McapFile* file) noexcept : file_(file), out_(file->scratch_) {}

  template <class Content>
  void record(Opcode opcode, const Content& content) noexcept {
    // Schemas are the longest records.
    constexpr std::size_t kMaxRecord = kScratch / 2;
    if (out_.size() > kScratch - kMaxRecord) flush();
    put_record(&out_, opcode, content);
  }
  void bytes(const void* data, std::size_t size) noexcept { out_.bytes(data, size); }
  /// The checksum begins here.
  void begin_crc() noexcept {
    flush();
    crc_ = 0;
  }
  [[nodiscard]] std::uint32_t crc() noexcept {
    flush();
    return crc_;
  }
  [[nodiscard]] std::uint64_t offset() const noexcept { return file_->end_ + out_.size(); }
  void flush() noexcept {
    if (out_.size() == 0 || error_ != 0) return;
    if (!out_.ok()) error_ = -EMSGSIZE;
    const auto bytes = out_.written();
    crc_ = libdeflate_crc32(crc_, bytes.data(), bytes.size());
    iovec piece{file_->scratch_.data(), bytes.size()};
    if (error_ == 0) error_ = file_->append(&piece, 1);
    out_ = ByteWriter(file_->scratch_);
  }
  [[nodiscard]] int error() const noexcept { return error_; }

 private:
  McapFile* file_;
  ByteWriter out_;
  std::uint32_t crc_ = 0;
  int error_ = 0;
};

McapFile::McapFile(Disk& disk, std::span<const McapTopic> topics, std::string library)
    : disk_(disk), topics_(topics), library_(std::move(library)), scratch_(kScratch) {
  assert(topics.size() <= kMaxChannels);
  entries_.reserve(kMaxMessages);
  chunks_.reserve(kMaxChunks);
}

McapFile::~McapFile() { abandon(); }

int McapFile::create(const char* path) noexcept {
  assert(fd_ < 0);
  const int fd = disk_.create(path);
  if (fd < 0) return fd;
  fd_ = fd;
  end_ = first_ = last_ = writeback_ = waiting_ = 0;
  chunks_.clear();
  counts_ = {};
  Appender out(this);
  out.bytes(kMagic.data(), kMagic.size());
  out.record(Opcode::header, [this](ByteWriter* w) { w->text("ros2").text(library_); });
  write_schemas(&out);
  write_channels(&out);
  out.flush();
  if (out.error() != 0) {
    abandon();
    // A file without its head is no recording and would block the next attempt.
    (void)::unlink(path);
  }
  return out.error();
}

void McapFile::write_schemas(Appender* out) const noexcept {
  for (std::size_t i = 0; i < topics_.size(); ++i)
    out->record(Opcode::schema, [&](ByteWriter* w) {
      const McapTopic& t = topics_[i];
      w->put(static_cast<std::uint16_t>(i + 1)).text(t.type).text("ros2msg").text(t.definition);
    });
}

void McapFile::write_channels(Appender* out) const noexcept {
  for (std::size_t i = 0; i < topics_.size(); ++i)
    out->record(Opcode::channel, [&](ByteWriter* w) {
      constexpr std::string_view kQos = "offered_qos_profiles";
      const auto id = static_cast<std::uint16_t>(i + 1);
      const std::string& qos = topics_[i].qos;
      w->put(id).put(id).text(topics_[i].topic).text("cdr");
      w->put(static_cast<std::uint32_t>(8 + kQos.size() + qos.size())).text(kQos).text(qos);
    });
}

int McapFile::append(iovec* pieces, int count) noexcept {
  std::uint64_t at = end_;
  while (count > 0) {
    if (pieces->iov_len == 0) {
      ++pieces, --count;
      continue;
    }
    const std::int64_t n = disk_.write(fd_, pieces, count, at);
    if (n < 0) {
      // An incomplete chunk is cut off.
      (void)!::ftruncate(fd_, static_cast<off_t>(end_));
      return static_cast<int>(n);
    }
    at += static_cast<std::uint64_t>(n);
    auto left = static_cast<std::size_t>(n);
    while (count > 0 && left >= pieces->iov_len) left -= pieces->iov_len, ++pieces, --count;
    if (count > 0) {
      pieces->iov_base = static_cast<std::uint8_t*>(pieces->iov_base) + left;
      pieces->iov_len -= left;
    }
  }
  end_ = at;
  return 0;
}

/// Lists the positions of a chunk's messages, and computes its checksum.
void McapFile::index_messages(std::span<const std::span<const std::uint8_t>> parts,
                              ChunkIndex* chunk, std::uint32_t* crc) noexcept {
  entries_.clear();
  chunk->start = std::numeric_limits<std::uint64_t>::max();
  for (std::span<const std::uint8_t> part : parts) {
    *crc = libdeflate_crc32(*crc, part.data(), part.size());
    while (!part.empty() && entries_.size() < kMaxMessages) {
      const auto head = McapMessageHead::read(part.first<McapMessageHead::kSize>());
      entries_.push_back({head.channel, head.log_time, chunk->records});
      chunk->start = std::min(chunk->start, head.log_time);
      chunk->end = std::max(chunk->end, head.log_time);
      chunk->records += head.record_size();
      part = part.subspan(head.record_size());
    }
  }
}

int McapFile::write_chunk(std::span<const std::span<const std::uint8_t>> parts) noexcept {
  assert(open() && !full() && parts.size() <= kMaxParts);
  ChunkIndex chunk;
  std::uint32_t crc = 0;
  index_messages(parts, &chunk, &crc);
  if (entries_.empty()) return 0;

  std::array<std::uint8_t, kChunkHead> head{};
  ByteWriter w(head);
  w.put(static_cast<std::uint8_t>(Opcode::chunk));
  w.put(static_cast<std::uint64_t>(kChunkHead - kRecordHead) + chunk.records);
  w.put(chunk.start).put(chunk.end).put(chunk.records).put(crc).text("").put(chunk.records);
  chunk.offset = end_;
  chunk.length = kChunkHead + chunk.records;

  ByteWriter index(scratch_);
  chunk.index.fill(kNone);
  for (std::size_t channel = 1; channel <= topics_.size(); ++channel) {
    const auto mine = [channel](const Entry& e) { return e.channel == channel; };
    if (std::ranges::none_of(entries_, mine)) continue;
    chunk.index[channel - 1] = static_cast<std::uint32_t>(index.size());
    put_record(&index, Opcode::message_index, [&](ByteWriter* out) {
      out->put(static_cast<std::uint16_t>(channel));
      const std::size_t size_at = out->size();
      out->put(std::uint32_t{0});
      for (const Entry& e : entries_)
        if (mine(e)) out->put(e.log_time).put(e.offset);
      out->overwrite(size_at, static_cast<std::uint32_t>(out->size() - size_at - 4));
    });
  }
  chunk.index_length = static_cast<std::uint32_t>(index.size());

  std::array<iovec, kMaxParts + 2> pieces{};
  int count = 0;
  pieces[static_cast<std::size_t>(count++)] = {head.data(), head.size()};
  // The parts are only read.
  for (const auto& part : parts)
    pieces[static_cast<std::size_t>(count++)] = {const_cast<std::uint8_t*>(part.data()),
                                                 part.size()};
  pieces[static_cast<std::size_t>(count++)] = {scratch_.data(), index.size()};
  if (const int error = append(pieces.data(), count); error != 0) return error;

  write_back(chunk);
  for (const Entry& e : entries_) ++counts_[e.channel - 1U];
  first_ = chunks_.empty() ? chunk.start : std::min(first_, chunk.start);
  last_ = std::max(last_, chunk.end);
  chunks_.push_back(chunk);
  return 0;
}

/// The disk writes this chunk while the next one is gathered; the previous one is written by now.
void McapFile::write_back(const ChunkIndex& chunk) noexcept {
  // Where the file system does not support it, pages are written as those of any other file.
  (void)::sync_file_range(fd_, static_cast<off64_t>(chunk.offset),
                          static_cast<off64_t>(end_ - chunk.offset), SYNC_FILE_RANGE_WRITE);
  if (chunk.offset > writeback_) {
    record_unwritten(disk_.finish_writeback(fd_, writeback_, chunk.offset - writeback_));
    writeback_ = chunk.offset;
    waiting_ = 0;
  }
  waiting_ += entries_.size();
}

/// The kernel does not report which pages failed, so all pending messages may be missing.
void McapFile::record_unwritten(int error) noexcept {
  if (error == 0) return;
  if (unwritten_.error == 0) unwritten_.error = error;
  unwritten_.messages += std::exchange(waiting_, 0);
}

void McapFile::write_statistics(Appender* out) const noexcept {
  out->record(Opcode::statistics, [this](ByteWriter* w) {
    std::uint64_t messages = 0;
    for (const std::uint64_t n : counts_) messages += n;
    const auto topics = static_cast<std::uint32_t>(topics_.size());
    // Numbers of schemas, channels, attachments, metadata records and chunks.
    w->put(messages).put(static_cast<std::uint16_t>(topics)).put(topics);
    w->put(std::uint32_t{0}).put(std::uint32_t{0}).put(static_cast<std::uint32_t>(chunks_.size()));
    w->put(first_).put(last_).put(10 * topics);
    for (std::size_t i = 0; i < topics_.size(); ++i)
      w->put(static_cast<std::uint16_t>(i + 1)).put(counts_[i]);
  });
}

void McapFile::write_chunk_indexes(Appender* out) const noexcept {
  for (const ChunkIndex& chunk : chunks_)
    out->record(Opcode::chunk_index, [&](ByteWriter* w) {
      w->put(chunk.start).put(chunk.end).put(chunk.offset).put(chunk.length);
      const std::size_t size_at = w->size();
      w->put(std::uint32_t{0});
      for (std::size_t i = 0; i < topics_.size(); ++i)
        if (chunk.index[i] != kNone)
          w->put(static_cast<std::uint16_t>(i + 1))
              .put(chunk.offset + chunk.length + chunk.index[i]);
      w->overwrite(size_at, static_cast<std::uint32_t>(w->size() - size_at - 4));
      w->put(std::uint64_t{chunk.index_length}).text("").put(chunk.records).put(chunk.records);
    });
}

int McapFile::finish() noexcept {
  if (fd_ < 0) return 0;
  Appender out(this);
  out.record(Opcode::data_end, [](ByteWriter* w) { w->put(std::uint32_t{0}); });
  out.begin_crc();
  const std::uint64_t summary = out.offset();
  // Starts of the groups, and the end of the last one.
  std::array<std::uint64_t, 5> starts{summary};
  write_schemas(&out);
  starts[1] = out.offset();
  write_channels(&out);
  starts[2] = out.offset();
  write_statistics(&out);
  starts[3] = out.offset();
  write_chunk_indexes(&out);
  const std::uint64_t offsets = starts[4] = out.offset();
  constexpr std::array kGroups{Opcode::schema, Opcode::channel, Opcode::statistics,
                               Opcode::chunk_index};
  for (std::size_t i = 0; i < kGroups.size(); ++i)
    if (starts[i + 1] > starts[i])
      out.record(Opcode::summary_offset, [&](ByteWriter* w) {
        w->put(static_cast<std::uint8_t>(kGroups[i])).put(starts[i]).put(starts[i + 1] - starts[i]);
      });
  // The checksum covers the footer up to itself.
  std::array<std::uint8_t, kRecordHead + 16> footer{};
  ByteWriter w(footer);
  w.put(static_cast<std::uint8_t>(Opcode::footer)).put(std::uint64_t{20});
  w.put(summary).put(offsets);
  out.bytes(footer.data(), footer.size());
  const std::uint32_t crc = out.crc();
  out.bytes(&crc, sizeof crc);
  out.bytes(kMagic.data(), kMagic.size());
  out.flush();
  int error = out.error();
  const int synchronised = disk_.synchronise(fd_);
  record_unwritten(synchronised);
  if (error == 0) error = synchronised;
  abandon();
  return error;
}

void McapFile::abandon() noexcept {
  if (fd_ < 0) return;
  (void)::close(fd_);
  fd_ = -1;
}

}  // namespace vergence::app
