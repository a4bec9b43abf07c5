#include "app/publish/publish.hpp"

#include <sys/random.h>

#include <cstdio>
#include <cstring>
#include <fstream>

namespace vergence::app {
namespace {

constexpr std::size_t kMinToken = 16, kMaxToken = 128;

/// 128 random bits of the kernel as hexadecimal digits.
std::string new_token() {
  std::array<std::uint8_t, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw InputError(
        "publish.http: the system has no random numbers for a token; set publish.token_file");
  std::string token;
  for (const std::uint8_t byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

std::string read_token(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line(kMaxToken + 2, '\0');
  if (!in)
    throw InputError(
        "publish.token_file: {} cannot be read; create it with one line of letters and digits",
        file.string());
  in.getline(line.data(), static_cast<std::streamsize>(line.size()));
  line.resize(std::strlen(line.c_str()));
  const bool plain = std::ranges::all_of(line, [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' ||
           c == '_';
  });
  if (line.size() < kMinToken || line.size() > kMaxToken || !plain)
    throw InputError(
        "publish.token_file: the first line of {} is not a token; write {} to {} letters, digits, "
        "- and _",
        file.string(), kMinToken, kMaxToken);
  return line;
}

}  // namespace

Publishing::Publishing(bool page, Configuration* configuration, SessionOptions* session) {
  PublishSettings& settings = configuration->publish;
  if (page && settings.http.empty()) settings.http = "127.0.0.1:8080";
  if (!settings.pose_stream.empty()) {
    const LineAddress address = parse_line_address(settings.pose_stream, "publish.pose_stream");
    try {
      lines_ = make_line_publisher(open_line_socket(address, "publish.pose_stream"), &requests_,
                                   configuration->calibration);
    } catch (const InputError& e) {
      fmt::print(stderr, "vergence: {}; the run continues without the pose stream\n", e.what());
    }
  }
  if (!settings.http.empty()) open_page(*configuration);
  if (page_) session->observers.push_back(page_.get());
  if (lines_) session->observers.push_back(lines_.get());
  session->requests = &requests_;
}

void Publishing::open_page(const Configuration& configuration) {
  const PublishSettings& settings = configuration.publish;
  const HostPort address = parse_host_port(settings.http, "publish.http");
  const HttpPolicy policy{settings.token_file.empty()
                              ? new_token()
                              : read_token(configuration.folder / settings.token_file),
                          !address.loopback(), address.host};
  try {
    page_ = make_live_page(address, policy, &requests_);
    // The fragment after # is not part of a request, so the token appears in no log.
    fmt::print(stderr, "live page: {}\n",
               settings.token_file.empty()
                   ? fmt::format("http://{}/#{}", address.link().text(), policy.token)
                   : fmt::format("http://{}/#TOKEN (TOKEN: the first line of {})",
                                 address.link().text(), settings.token_file));
  } catch (const InputError& e) {
    fmt::print(stderr, "vergence: {}; the run continues without the live page\n", e.what());
  }
}

}  // namespace vergence::app
