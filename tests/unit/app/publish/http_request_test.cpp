#include "app/publish/http_request.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace vergence::app {
namespace {

const std::string kToken = "0123456789abcdef";
const HttpPolicy kHere{kToken, false, "127.0.0.1"}, kBeyond{kToken, true, "0.0.0.0"};

HttpDecision answer(const std::string& text, const HttpPolicy& policy) {
  HttpRequest request;
  EXPECT_EQ(parse_http_request(text, &request), HttpParse::complete) << text;
  return decide(request, policy);
}

std::string get(const std::string& target, const std::string& host = "127.0.0.1:8080") {
  return "GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\n\r\n";
}

std::string post(const std::string& more) {
  return "POST /mark HTTP/1.1\r\nHost: 127.0.0.1:8080\r\n" + more + "\r\n";
}

TEST(HttpRequest, isReadFromItsBytes) {
  HttpRequest r;
  const std::string text =
      "GET /events?a=b&token=xyz HTTP/1.1\r\nhOsT:  localhost:1 \r\nOrigin: http://x\r\n\r\nrest";
  ASSERT_EQ(parse_http_request(text, &r), HttpParse::complete);
  EXPECT_EQ(r.method, "GET");
  EXPECT_EQ(r.path, "/events");
  EXPECT_EQ(r.token, "xyz");
  EXPECT_FALSE(r.token_in_header);
  EXPECT_EQ(r.host, "localhost:1");
  EXPECT_EQ(r.origin, "http://x");
  for (std::size_t n = 0; n < text.size() - 4; ++n)
    EXPECT_EQ(parse_http_request(text.substr(0, n), &r), HttpParse::incomplete) << n;
}

TEST(HttpRequest, thatIsNoneIsMalformed) {
  HttpRequest r;
  for (const char* text :
       {"\r\n\r\n", "GET /\r\n\r\n", "GET  HTTP/1.1\r\n\r\n", "GET / HTTP/2\r\n\r\n",
        "GET x HTTP/1.1\r\n\r\n", "GET /\x01 HTTP/1.1\r\n\r\n", "GET / HTTP/1.1\r\nnothing\r\n\r\n",
        "GET / HTTP/1.1\r\n: x\r\n\r\n", "GET / HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
        "GET / HTTP/1.1\r\nContent-Length: 99999999999999999999\r\n\r\n"})
    EXPECT_EQ(parse_http_request(text, &r), HttpParse::malformed) << text;
  EXPECT_EQ(parse_http_request(std::string(kMostRequestBytes, 'x'), &r), HttpParse::too_large);
  std::string many = "GET / HTTP/1.1\r\n";
  for (int i = 0; i < 100; ++i) many += "a: b\r\n";
  EXPECT_EQ(parse_http_request(many + "\r\n", &r), HttpParse::malformed) << "too many headers";
}

TEST(HttpPolicy, onThisMachineAnyoneMayRead) {
  EXPECT_EQ(answer(get("/"), kHere).route, HttpRoute::page);
  EXPECT_EQ(answer(get("/events"), kHere).route, HttpRoute::events);
  EXPECT_EQ(answer(get("/events", "localhost"), kHere).route, HttpRoute::events);
  EXPECT_EQ(answer(get("/events", "[::1]:8080"), kHere).route, HttpRoute::events);
  EXPECT_EQ(answer(get("/other"), kHere).status, 404);
  EXPECT_EQ(answer("PUT / HTTP/1.1\r\nHost: localhost\r\n\r\n", kHere).status, 405);
}

TEST(HttpPolicy, aNameThatSomebodyElsePointsHereIsRefused) {
  for (const char* host : {"evil.example:8080", "", "127.0.0.1.evil.example", "[::2]:1"})
    EXPECT_EQ(answer(get("/events", host), kHere).status, 421) << host;
}

TEST(HttpPolicy, beyondThisMachineTheTokenIsNeeded) {
  EXPECT_EQ(answer(get("/", "rig.local"), kBeyond).route, HttpRoute::page) << "it holds nothing";
  EXPECT_EQ(answer(get("/events", "rig.local"), kBeyond).status, 403);
  EXPECT_EQ(answer(get("/events?token=" + kToken.substr(1), "rig.local"), kBeyond).status, 403);
  EXPECT_EQ(answer(get("/events?token=" + kToken, "rig.local"), kBeyond).route, HttpRoute::events);
  const std::string head = "GET /events HTTP/1.1\r\nHost: rig.local\r\nX-Vergence-Token: ";
  EXPECT_EQ(answer(head + kToken + "\r\n\r\n", kBeyond).route, HttpRoute::events);
  EXPECT_EQ(answer(head + kToken.substr(1) + "\r\n\r\n", kBeyond).status, 403);
}

TEST(HttpPolicy, actionsNeedAHeaderThatNoOtherSiteCanSend) {
  const std::string header = "X-Vergence-Token: " + kToken + "\r\n";
  for (const HttpPolicy& policy : {kHere, kBeyond}) {
    EXPECT_EQ(answer(post(header), policy).route, HttpRoute::mark);
    EXPECT_EQ(answer(post(""), policy).status, 403);
    EXPECT_EQ(answer(post("X-Vergence-Token: 0123456789abcdeF\r\n"), policy).status, 403);
    EXPECT_EQ(answer("POST /mark?token=" + kToken + " HTTP/1.1\r\nHost: localhost\r\n\r\n", policy)
                  .status,
              403)
        << "a form of another site could send that";
    EXPECT_EQ(answer(post(header + "Origin: http://evil.example\r\n"), policy).status, 403);
    EXPECT_EQ(answer(post(header + "Origin: null\r\n"), policy).status, 403);
    EXPECT_EQ(answer(post(header + "Origin: http://127.0.0.1:8080\r\n"), policy).route,
              HttpRoute::mark);
    EXPECT_EQ(answer(post(header + "Content-Length: 1\r\n"), policy).status, 413);
    EXPECT_EQ(answer(post(header + "Transfer-Encoding: chunked\r\n"), policy).status, 413);
  }
  EXPECT_EQ(answer("GET /mark HTTP/1.1\r\nHost: localhost\r\n" + header + "\r\n", kHere).status,
            404);
  HttpPolicy none = kHere;
  none.token.clear();
  EXPECT_EQ(answer(post("X-Vergence-Token: \r\n"), none).status, 403) << "no token is no key";
}

TEST(HttpRequest, mutatedBytesNeitherCrashNorOpenAnything) {
  std::mt19937 random(20261122);
  const std::string seeds[] = {get("/events?token=" + kToken), get("/"),
                               post("X-Vergence-Token: " + kToken + "\r\nOrigin: http://a\r\n"),
                               post("Content-Length: 3\r\nTransfer-Encoding: x\r\n")};
  for (int run = 0; run < 40'000; ++run) {
    std::string bytes = seeds[random() % std::size(seeds)];
    for (std::size_t n = random() % 6; n > 0 && !bytes.empty(); --n) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 4) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:
          bytes.erase(at, random() % 9);
          break;
        case 2:
          bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 30));
          break;
        default:
          bytes.insert(at, random() % 2 == 0 ? "\r\n" : "?token=");
      }
    }
    ASSERT_EQ(
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()),
        0);
  }
}

}  // namespace
}  // namespace vergence::app
