#include "app/publish/http_server.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <random>
#include <vector>

#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

constexpr const char* kPage = "<p>the page</p>";
const std::string kToken = "0123456789abcdef";
const std::string kKey = "X-Vergence-Token: " + kToken + "\r\n";

class Http : public testing::Test {
 protected:
  Http() { serve_with({kToken, false, "127.0.0.1"}); }

  void serve_with(const HttpPolicy& policy) {
    server_.reset();
    while (!server_) {
      try {
        server_ = std::make_unique<HttpServer>(HostPort{"127.0.0.1", ++port_}, policy, kPage,
                                               [this](HttpRoute route, const HttpRequest& request) {
                                                 if (route == HttpRoute::state) {
                                                   ++states_;
                                                   return state_ + std::string(request.after);
                                                 }
                                                 acted_.push_back(route);
                                                 return std::string();
                                               });
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
    for (int i = 0; i < 6; ++i) server_->step(std::chrono::milliseconds(1));
  }
  static std::string received(const FileDescriptor& socket) {
    std::string text;
    std::array<char, 65536> bytes;
    for (ssize_t n; (n = ::recv(socket.get(), bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0;)
      text.append(bytes.data(), static_cast<std::size_t>(n));
    return text;
  }
  std::uint16_t port_ = 38100;
  std::vector<HttpRoute> acted_;
  std::string state_ = "state";
  int states_ = 0;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(Http, pageHasRestrictiveHeaders) {
  const std::string answer = received(ask("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 OK\r\n")) << answer;
  EXPECT_EQ(answer.substr(answer.find("\r\n\r\n") + 4), kPage);
  EXPECT_NE(answer.find("Content-Security-Policy: default-src 'none'"), std::string::npos);
  EXPECT_EQ(answer.find("Access-Control"), std::string::npos) << "no other site may read it";
}

TEST_F(Http, portInUseIsInputError) {
  EXPECT_TRUE(test::contains(test::refusal_of([&] {
                               const HttpServer second(HostPort{"127.0.0.1", port_}, {}, kPage, {});
                             }),
                             "another program uses the port"));
}

/// A request's first line and headers, and what becomes of it.
struct Ask {
  std::string head;
  int status;
};

class HttpPolicies : public Http {
 protected:
  void expect(const std::vector<Ask>& asks, const std::string& host) {
    for (const Ask& a : asks) {
      const auto line = a.head.find("\r\n");
      const std::string text = a.head.substr(0, line) + " HTTP/1.1\r\nHost: " + host + "\r\n" +
                               a.head.substr(line + 2) + "\r\n";
      const std::string answer = received(ask(text));
      EXPECT_TRUE(answer.starts_with("HTTP/1.1 " + std::to_string(a.status))) << text << answer;
    }
  }
};
TEST_F(HttpPolicies, admitsOnlyRequestsWithToken) {
  const std::vector<Ask> actions{{"POST /mark\r\n" + kKey, 204},
                                 {"POST /recalibrate\r\n" + kKey, 204},
                                 {"POST /mark\r\n" + kKey + "Content-Length: 0\r\n", 204},
                                 {"POST /mark\r\n", 403},
                                 {"POST /mark\r\nX-Vergence-Token: 0123456789abcdeF\r\n", 403},
                                 {"POST /mark\r\nX-Vergence-Token: \r\n", 403},
                                 // A form of another site could send this request.
                                 {"POST /mark?token=" + kToken + "\r\n", 403},
                                 {"POST /mark\r\n" + kKey + "Origin: http://evil.example\r\n", 403},
                                 {"POST /mark\r\n" + kKey + "Origin: null\r\n", 403},
                                 {"POST /mark\r\n" + kKey + "Content-Length: 1\r\n", 413},
                                 {"POST /mark\r\n" + kKey + "Transfer-Encoding: chunked\r\n", 413},
                                 {"POST /other\r\n" + kKey, 404},
                                 {"GET /mark\r\n" + kKey, 404},
                                 {"PUT /\r\n", 405},
                                 {"GET /other\r\n", 404}};
  expect(actions, "localhost");
  EXPECT_EQ(acted_, (std::vector{HttpRoute::mark, HttpRoute::recalibrate, HttpRoute::mark}));
  for (const char* host : {"localhost", "127.0.0.1:8080", "[::1]:8080"})
    expect({{"GET /\r\n", 200}, {"GET /state\r\n", 200}}, host), serve_with({kToken, false, "x"});
  for (const char* host : {"evil.example:8080", "127.0.0.1.evil.example", "[::2]:1"})
    expect({{"GET /\r\n", 421}, {"GET /state\r\n", 421}, {"POST /mark\r\n" + kKey, 421}}, host);
  // Beyond this machine: by any name, but with the token.
  serve_with({kToken, true, "0.0.0.0"});
  expect(actions, "rig.local");
  expect({{"GET /\r\n", 200},
          {"GET /state\r\n", 403},
          {"GET /state?token=" + kToken.substr(1) + "\r\n", 403},
          {"GET /state\r\nX-Vergence-Token: " + kToken.substr(1) + "\r\n", 403},
          {"GET /state?a=b&token=" + kToken + "\r\n", 200},
          {"GET /state\r\n" + kKey, 200}},
         "rig.local");
  serve_with({"", false, "localhost"});
  expect({{"POST /mark\r\nX-Vergence-Token: \r\n", 403}}, "localhost");
}

TEST_F(Http, stateIsAnsweredOrNoContent) {
  const std::string request =
      "GET /state?epoch=1&after=42&image= HTTP/1.1\r\nHost: localhost\r\n\r\n";
  EXPECT_TRUE(received(ask(request)).ends_with("\r\n\r\nstate42"));
  state_.clear();
  EXPECT_TRUE(
      received(ask("GET /state HTTP/1.1\r\nHost: localhost\r\n\r\n")).starts_with("HTTP/1.1 204"));
}

/// A viewer that sends requests and reads nothing costs one response.
TEST_F(Http, stalledViewerHoldsOneResponse) {
  // This is more than sockets buffer.
  state_.assign(32'000'000, 'x');
  const std::string request = "GET /state HTTP/1.1\r\nHost: localhost\r\n\r\n";
  std::string requests;
  for (int i = 0; i < 20; ++i) requests += request;
  const FileDescriptor stalled = ask(requests);
  EXPECT_TRUE(received(ask("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")).ends_with(kPage));
  EXPECT_EQ(states_, 1);
}

TEST_F(Http, garbageAndIdleConnectionsAreDropped) {
  std::mt19937 random(7);
  for (int i = 0; i < 50; ++i) {
    std::string noise(random() % 9000, '\0');
    for (char& c : noise) c = static_cast<char>(random());
    const FileDescriptor socket = ask(noise);
    const std::string answer = received(socket);
    EXPECT_TRUE(answer.empty() || answer.starts_with("HTTP/1.")) << answer;
    EXPECT_EQ(answer.find(" 200 "), std::string::npos);
  }
  EXPECT_TRUE(acted_.empty());
  std::vector<FileDescriptor> idle;
  for (int i = 0; i < 500; ++i) idle.push_back(connect());
  serve();
  const FileDescriptor other = connect();
  const std::string text = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
  (void)::send(other.get(), text.data(), text.size(), MSG_NOSIGNAL);
  std::string answer;
  for (int i = 0; i < 1000 && !answer.ends_with(kPage); ++i) {
    server_->step(std::chrono::milliseconds(1));
    answer += received(other);
  }
  EXPECT_TRUE(answer.ends_with(kPage));
}

/// An address of the configuration and what is read of it; port 0: refused.
struct AddressCase {
  const char* text;
  const char* host = "";
  std::uint16_t port = 0;
  bool loopback = false;
};

TEST(Address, parsesHostAndPort) {
  for (const AddressCase& a : {AddressCase{"127.0.0.1:8080", "127.0.0.1", 8080, true},
                               {"[::1]:80", "::1", 80, true},
                               {"localhost:1", "localhost", 1, true},
                               {"0.0.0.0:8080", "0.0.0.0", 8080, false},
                               {"rig.local:65535", "rig.local", 65535, false},
                               {"127.evil.example:80", "127.evil.example", 80, false},
                               {"8080"},
                               {":8080"},
                               {"h:"},
                               {"h:0"},
                               {"h:65536"},
                               {"h:80x"},
                               {"::1:80"},
                               {"[h]:80"},
                               {""}}) {
    if (a.port == 0) {
      EXPECT_THROW((void)parse_host_port(a.text, "key"), InputError) << a.text;
      continue;
    }
    const HostPort address = parse_host_port(a.text, "key");
    EXPECT_EQ(address.host, a.host);
    EXPECT_EQ(address.port, a.port);
    EXPECT_EQ(address.loopback(), a.loopback) << a.text;
  }
  EXPECT_NE(parse_host_port("0.0.0.0:1", "key").link().host, "0.0.0.0") << "nobody can open that";
  EXPECT_EQ(parse_line_address("unix:///run/p.sock", "key").path, "/run/p.sock");
  EXPECT_EQ(parse_line_address("udp://127.0.0.1:9", "key").udp.port, 9);
  for (const char* text : {"unix://x", "tcp://a:1", "/run/p.sock", "udp://a"})
    EXPECT_THROW((void)parse_line_address(text, "key"), InputError) << text;
}

}  // namespace
}  // namespace vergence::app
