#include "app/publish/http_server.hpp"

#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>
#include <vector>

#include "app/runtime/errors.hpp"
#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

using std::chrono::milliseconds;

constexpr const char* kPage = "<p>the page</p>";
const std::string kToken = "0123456789abcdef";

class Http : public testing::Test {
 protected:
  Http() {
    while (!server_) {
      try {
        server_ = std::make_unique<HttpServer>(
            HostPort{"127.0.0.1", ++port_}, HttpPolicy{kToken, false, "127.0.0.1"}, kPage, 2,
            [this](HttpRoute route) { acted_.push_back(route); });
      } catch (const InputError&) {
        if (port_ > 60000) throw;
      }
    }
  }

  FileDescriptor connect() const {
    FileDescriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port_);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    (void)::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
    return socket;
  }
  FileDescriptor ask(const std::string& text) {
    FileDescriptor socket = connect();
    serve();
    (void)::send(socket.get(), text.data(), text.size(), MSG_NOSIGNAL);
    serve();
    return socket;
  }
  void serve() {
    for (int i = 0; i < 4; ++i) server_->step(milliseconds(1));
  }
  static std::string received(const FileDescriptor& socket) {
    std::string text;
    std::array<char, 65536> bytes;
    for (ssize_t n; (n = ::recv(socket.get(), bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0;)
      text.append(bytes.data(), static_cast<std::size_t>(n));
    return text;
  }
  FileDescriptor viewer() { return ask("GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n"); }

  std::uint16_t port_ = 38100;
  std::vector<HttpRoute> acted_;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(Http, servesThePageWithHeadersThatLetNothingElseIn) {
  const std::string answer = received(ask("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 OK\r\n")) << answer;
  EXPECT_EQ(answer.substr(answer.find("\r\n\r\n") + 4), kPage);
  EXPECT_NE(answer.find("Content-Security-Policy: default-src 'none'"), std::string::npos);
  EXPECT_EQ(answer.find("Access-Control"), std::string::npos) << "no other site may read it";
}

TEST_F(Http, aPortInUseIsASentence) {
  EXPECT_TRUE(test::contains(
      test::refusal_of([&] {
        const HttpServer second(HostPort{"127.0.0.1", port_}, {}, kPage, 1, [](HttpRoute) {});
      }),
      "another program has the port"));
}

TEST_F(Http, viewersAreGreetedThenToldWhatIsNewAndNoMoreThanAllowed) {
  const FileDescriptor a = viewer();
  EXPECT_EQ(server_->viewers(), 1U);
  server_->broadcast("update", "{\"a\":1}", HttpServer::Skipped::greet_again);
  server_->greet("hello", [] { return std::string("{}"); });
  server_->broadcast("update", "{\"a\":2}", HttpServer::Skipped::greet_again);
  const std::string text = received(a);
  EXPECT_EQ(text.find("{\"a\":1}"), std::string::npos) << "it had not been greeted";
  EXPECT_NE(text.find("event: hello\ndata: {}\n\nevent: update\ndata: {\"a\":2}\n\n"),
            std::string::npos)
      << text;
  const FileDescriptor b = viewer(), c = viewer();
  EXPECT_EQ(server_->viewers(), 2U);
  EXPECT_TRUE(received(c).starts_with("HTTP/1.1 503"));
  int asked = 0;
  server_->greet("hello", [&] { return ++asked, std::string("{}"); });
  server_->greet("hello", [&] { return ++asked, std::string("{}"); });
  EXPECT_EQ(asked, 1) << "made once, and only for who waits for it";
}

TEST_F(Http, aViewerThatNeverReadsSkipsAndIsGreetedAnewWhenItReads) {
  const FileDescriptor a = viewer();
  server_->greet("hello", [] { return std::string("{}"); });
  const std::string big = "\"" + std::string(200'000, 'x') + "\"";
  for (int i = 0; i < 60; ++i) server_->broadcast("update", big, HttpServer::Skipped::greet_again);
  EXPECT_GT(server_->counters().skipped, 0U);
  const auto skipped = server_->counters().skipped;
  server_->greet("hello", [] { return std::string("{}"); });
  EXPECT_EQ(server_->counters().skipped, skipped) << "its place in the queue is still taken";
  for (int i = 0; i < 200; ++i) {
    (void)received(a);
    server_->step(milliseconds(1));
  }
  server_->greet("hello", [] { return std::string("{\"anew\":1}"); });
  EXPECT_NE(received(a).find("anew"), std::string::npos);
}

TEST_F(Http, actionsComeThroughWithTheTokenOnly) {
  const std::string head = "POST /recalibrate HTTP/1.1\r\nHost: localhost\r\n";
  EXPECT_TRUE(received(ask(head + "\r\n")).starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(acted_.empty());
  EXPECT_TRUE(
      received(ask(head + "X-Vergence-Token: " + kToken + "\r\n\r\n")).starts_with("HTTP/1.1 204"));
  EXPECT_EQ(acted_, std::vector{HttpRoute::recalibrate});
}

TEST_F(Http, garbageAndAThousandConnectionsLeaveThePageToOthers) {
  const FileDescriptor watching = viewer();
  server_->greet("hello", [] { return std::string("{}"); });
  std::mt19937 random(7);
  for (int i = 0; i < 50; ++i) {
    std::string noise(random() % 9000, '\0');
    for (char& c : noise) c = static_cast<char>(random());
    const FileDescriptor socket = ask(noise);
    const std::string answer = received(socket);
    EXPECT_TRUE(answer.empty() || answer.starts_with("HTTP/1.1 4")) << answer;
  }
  std::vector<FileDescriptor> idle;
  for (int i = 0; i < 500; ++i) {  // as many as a process may hold without asking for more
    idle.push_back(connect());
    if (i % 16 == 0) server_->step(milliseconds(0));
  }
  serve();
  EXPECT_TRUE(received(ask("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")).ends_with(kPage));
  EXPECT_EQ(server_->viewers(), 1U) << "whoever looks keeps its place";
  EXPECT_GT(server_->counters().pushed_out, 400U);
  server_->broadcast("update", "{\"still\":1}", HttpServer::Skipped::greet_again);
  EXPECT_NE(received(watching).find("still"), std::string::npos);
}

}  // namespace
}  // namespace vergence::app
