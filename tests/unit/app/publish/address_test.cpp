#include "app/publish/address.hpp"

#include <gtest/gtest.h>

#include "app/runtime/errors.hpp"
#include "tests/support/refusal.hpp"

namespace vergence::app {
namespace {

TEST(Address, isAHostAndAPort) {
  const HostPort a = parse_host_port("127.0.0.1:8080", "k");
  EXPECT_EQ(a.host, "127.0.0.1");
  EXPECT_EQ(a.port, 8080);
  EXPECT_TRUE(a.loopback());
  const HostPort b = parse_host_port("[fe80::1]:65535", "k");
  EXPECT_EQ(b.host, "fe80::1");
  EXPECT_EQ(b.text(), "[fe80::1]:65535");
  EXPECT_FALSE(b.loopback());
  EXPECT_TRUE(parse_host_port("[::1]:1", "k").loopback());
  EXPECT_TRUE(parse_host_port("localhost:1", "k").loopback());
  EXPECT_FALSE(parse_host_port("0.0.0.0:8080", "k").loopback());
  EXPECT_FALSE(parse_host_port("127.example.org:80", "k").loopback()) << "a name, not a number";
}

TEST(Address, whatIsNoneIsRefusedWithItsKey) {
  for (const char* text : {"", ":", "8080", "host:", ":80", "host:0", "host:65536", "host:80x",
                           "host:-1", "a b:80", "[::1:80", "[]:80", "[x]:80", "::1:80:"})
    EXPECT_TRUE(test::refusal_of([&] {
                  (void)parse_host_port(text, "publish.http");
                }).starts_with("publish.http: "))
        << text;
}

TEST(Address, ofLinesIsASocketFileOrADatagramsGoal) {
  EXPECT_EQ(parse_line_address("unix:///run/a.sock", "k").path, "/run/a.sock");
  const LineAddress udp = parse_line_address("udp://10.0.0.7:9870", "k");
  EXPECT_EQ(udp.kind, LineAddress::Kind::udp);
  EXPECT_EQ(udp.udp.port, 9870);
  EXPECT_THROW((void)parse_line_address("unix://run/a.sock", "k"), InputError);
  EXPECT_THROW((void)parse_line_address("tcp://host:1", "k"), InputError);
  EXPECT_THROW((void)parse_line_address("unix:///" + std::string(107, 'x'), "k"), InputError);
  EXPECT_EQ(parse_line_address("unix:///" + std::string(106, 'x'), "k").path.size(), 107U);
}

}  // namespace
}  // namespace vergence::app
