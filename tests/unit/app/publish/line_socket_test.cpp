#include "app/publish/line_socket.hpp"

#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <gtest/gtest.h>

#include <array>

#include "drivers/clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

FileDescriptor reader_of(const std::string& path) {
  FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  EXPECT_EQ(::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
            0);
  return socket;
}

std::string all_of(const FileDescriptor& socket) {
  std::string text;
  std::array<char, 65536> bytes;
  for (ssize_t n; (n = ::recv(socket.get(), bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0;)
    text.append(bytes.data(), static_cast<std::size_t>(n));
  return text;
}

/// Work of the publisher between two lines.
void wait(LineSocket* socket, const LineSocket::Answer& answer = {}) {
  const FileDescriptor wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  socket->wait(wake.get(), Duration::milliseconds(1), answer);
}

class UnixLines : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::string path_ = (folder_.path() / "pose.sock").string();
  LineAddress address_{LineAddress::Kind::unix_socket, path_, {}};
};

TEST_F(UnixLines, socketModeIgnoresUmask) {
  const mode_t before = ::umask(0077);
  const auto lines = open_line_socket(address_, "k");
  (void)::umask(before);
  struct stat status {};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0660U);
}

TEST_F(UnixLines, stalledReaderLosesWholeLines) {
  const auto socket = open_line_socket(address_, "k");
  const FileDescriptor idle = reader_of(path_), eager = reader_of(path_);
  wait(socket.get());
  std::string eager_text;
  constexpr int kLines = 4000;
  const std::string body(500, 'x');
  for (int i = 0; i < kLines; ++i) {
    socket->send(std::to_string(i) + body + "\n");
    eager_text += all_of(eager);
  }
  EXPECT_EQ(std::count(eager_text.begin(), eager_text.end(), '\n'), kLines);
  EXPECT_GT(socket->counters().refused, 0U);
  // Later lines are complete again.
  std::string text = all_of(idle);
  for (int i = 0; i < 3; ++i) {
    socket->send("end\n");
    text += all_of(idle);
  }
  std::size_t begin = 0;
  int whole = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    const std::string line = text.substr(begin, end - begin);
    EXPECT_TRUE(line == "end" || line.ends_with(body)) << line.substr(0, 40);
    EXPECT_EQ(line.find(body) == std::string::npos ? 0 : 1,
              static_cast<int>(std::count(line.begin(), line.end(), 'x')) / 500);
    ++whole;
  }
  EXPECT_LT(whole, kLines);
  EXPECT_GT(whole, 10);
}

TEST_F(UnixLines, readersBeyondTheLimitAreTurnedAway) {
  const auto socket = open_line_socket(address_, "k");
  std::vector<FileDescriptor> readers;
  for (int i = 0; i < 12; ++i) {
    readers.push_back(reader_of(path_));
    wait(socket.get());
  }
  EXPECT_EQ(socket->counters().readers, 8U);
  EXPECT_EQ(socket->counters().turned_away, 4U);
  readers.clear();
  socket->send("finds them gone\n");
  const FileDescriptor late = reader_of(path_);
  wait(socket.get());
  socket->send("line\n");
  EXPECT_EQ(all_of(late), "line\n");
}

TEST_F(UnixLines, greetsFirstAndOnChange) {
  const auto socket = open_line_socket(address_, "k");
  const FileDescriptor early = reader_of(path_);
  wait(socket.get());
  socket->send("1\n");
  socket->greet("a\n");
  const FileDescriptor late = reader_of(path_);
  wait(socket.get());
  socket->send("2\n");
  socket->greet("b\n");
  EXPECT_EQ(all_of(early), "1\na\n2\nb\n");
  EXPECT_EQ(all_of(late), "a\n2\nb\n");
}

TEST_F(UnixLines, greetingReachesStalledReader) {
  const auto socket = open_line_socket(address_, "k");
  const FileDescriptor reader = reader_of(path_);
  wait(socket.get());
  const std::string body(5000, 'x');
  while (socket->counters().refused == 0) socket->send(body + "\n");
  socket->greet("greeting\n");
  (void)all_of(reader);
  // This sends the rest of a line and the greeting.
  socket->send("");
  socket->send("line\n");
  EXPECT_TRUE(all_of(reader).ends_with("greeting\nline\n"));
}

TEST_F(UnixLines, answersRequestsToTheirSender) {
  const auto socket = open_line_socket(address_, "k");
  const FileDescriptor asking = reader_of(path_), silent = reader_of(path_);
  wait(socket.get());
  const auto answer = [](std::string_view request) {
    return LineResponse{"<" + std::string(request) + ">\n", {}};
  };
  const auto send = [&](const FileDescriptor& reader, std::string_view text) {
    EXPECT_EQ(::send(reader.get(), text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
    wait(socket.get(), answer);
  };
  send(asking, "hal");
  EXPECT_EQ(all_of(asking), "");
  send(asking, "f\ntwo\n\n");
  EXPECT_EQ(all_of(asking), "<half>\n<two>\n<>\n");
  // A reader that closes only its own side continues reading.
  (void)::shutdown(asking.get(), SHUT_WR);
  wait(socket.get(), answer);
  socket->send("line\n");
  EXPECT_EQ(all_of(asking), "line\n");
  // A request without an end costs the connection, not memory.
  for (int i = 0; i < 3; ++i)
    if (::send(silent.get(), std::string(300, 'x').data(), 300, MSG_NOSIGNAL) == 300)
      wait(socket.get(), answer);
  socket->send("line\n");
  char byte = 0;
  EXPECT_EQ(all_of(silent), "line\n") << "the one before";
  EXPECT_LE(::recv(silent.get(), &byte, 1, MSG_DONTWAIT), 0);
}

TEST_F(UnixLines, imageReaderGetsWholePairsAtItsRateAndNoLines) {
  const auto socket = open_line_socket(address_, "k");
  const FileDescriptor images = reader_of(path_), lines = reader_of(path_);
  wait(socket.get());
  EXPECT_FALSE(socket->wants_images());
  ASSERT_EQ(::send(images.get(), "i\n", 2, MSG_NOSIGNAL), 2);
  wait(socket.get(), [](std::string_view) {
    return LineResponse{"yes\n", Duration::milliseconds(50)};
  });
  // This is more than a socket buffers.
  const std::string pair(1'000'000, 'p');
  ASSERT_TRUE(socket->wants_images());
  const HostStamp begin = monotonic_now();
  socket->send_images(pair);
  EXPECT_FALSE(socket->wants_images()) << "it has not read the pair";
  socket->send_images("dropped");
  socket->greet("greeting\n");
  socket->send("line\n");
  std::string read;
  while (read.size() < 4 + pair.size() && monotonic_now() - begin < Duration::seconds(10)) {
    read += all_of(images);
    wait(socket.get());
  }
  EXPECT_EQ(read, "yes\n" + pair);
  EXPECT_EQ(all_of(lines), "greeting\nline\n");
  while (!socket->wants_images() && monotonic_now() - begin < Duration::seconds(10))
    wait(socket.get());
  EXPECT_GE(monotonic_now() - begin, Duration::milliseconds(20)) << "half the interval";
  EXPECT_EQ(socket->counters().images, 1U);
}

TEST_F(UnixLines, replacesOnlyStaleSocketFiles) {
  {
    // As a killed program leaves it: bound, and nobody listens.
    const FileDescriptor dead(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    ASSERT_EQ(::bind(dead.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  auto first = open_line_socket(address_, "k");
  EXPECT_THROW((void)open_line_socket(address_, "k"), InputError);
  first.reset();
  EXPECT_FALSE(std::filesystem::exists(path_));
  LineAddress nowhere = address_;
  nowhere.path = (folder_.path() / "no" / "pose.sock").string();
  EXPECT_THROW((void)open_line_socket(nowhere, "k"), InputError);
}

}  // namespace
}  // namespace vergence::app
