#include "app/publish/line_socket.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>

#include "app/runtime/errors.hpp"
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

class UnixLines : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::string path_ = (folder_.path() / "pose.sock").string();
  LineAddress address_{LineAddress::Kind::unix_socket, path_, {}};
};

TEST_F(UnixLines, theGroupMayReadWhateverTheUmaskAndNobodyElse) {
  const mode_t before = ::umask(0077);
  const auto lines = open_line_socket(address_, "k");
  (void)::umask(before);
  struct stat status {};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0660U);
}

TEST_F(UnixLines, whoDoesNotReadLosesWholeLinesAndHoldsNobodyUp) {
  const auto socket = open_line_socket(address_, "k");
  const FileDescriptor idle = reader_of(path_), eager = reader_of(path_);
  std::string eager_text;
  constexpr int kLines = 4000;
  const std::string body(500, 'x');
  for (int i = 0; i < kLines; ++i) {
    socket->send(std::to_string(i) + body + "\n");
    eager_text += all_of(eager);
  }
  EXPECT_EQ(std::count(eager_text.begin(), eager_text.end(), '\n'), kLines);
  EXPECT_GT(socket->counters().refused, 0U);
  // What comes after is whole again.
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

TEST_F(UnixLines, readersBeyondThePlacesAreTurnedAwayAndThoseWhoLeaveMakeRoom) {
  const auto socket = open_line_socket(address_, "k");
  std::vector<FileDescriptor> readers;
  for (int i = 0; i < 12; ++i) {
    readers.push_back(reader_of(path_));
    socket->send("line\n");
  }
  EXPECT_EQ(socket->counters().readers, 8U);
  EXPECT_EQ(socket->counters().turned_away, 4U);
  readers.clear();
  socket->send("finds them gone\n");
  const FileDescriptor late = reader_of(path_);
  socket->send("line\n");
  EXPECT_EQ(all_of(late), "line\n");
}

TEST_F(UnixLines, aFileLeftBehindIsReplacedAnotherProgramsIsNot) {
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
