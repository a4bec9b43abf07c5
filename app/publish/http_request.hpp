#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "app/publish/address.hpp"

namespace vergence::app {

/// The head of one HTTP request, as far as the live page needs it: views of the bytes received.
struct HttpRequest {
  std::string_view method{}, path{};  // path without the query
  std::string_view token{};           // of the header X-Vergence-Token, or the query `token=`
  std::string_view host{}, origin{};
  bool token_in_header = false;
  std::uint64_t content_length = 0;
  bool chunked = false;  // Transfer-Encoding is given
};

inline constexpr std::size_t kMostRequestBytes = 4096;  // browsers send some 600

enum class HttpParse : std::uint8_t {
  incomplete,  // more bytes are wanted
  complete,
  malformed,  // no HTTP/1.x request
  too_large,  // no end within kMostRequestBytes
};

/// Reads a head from the beginning of `bytes`. A pure function: no memory, no state; bytes of any
/// value. Not complete: *request is undefined.
[[nodiscard]] HttpParse parse_http_request(std::string_view bytes, HttpRequest* request) noexcept;

/// Whom the live page answers.
struct HttpPolicy {
  std::string token{};
  bool token_to_read = false;  // bound beyond this machine
  std::string host{};          // of the configuration; a Host header may name it
};

enum class HttpRoute : std::uint8_t { refuse, page, events, recalibrate, mark, stop_recording };

struct HttpDecision {
  HttpRoute route = HttpRoute::refuse;
  int status = 200;
  const char* sentence = "";  // of a refusal
};

/// The page itself holds nothing of the session and is for everyone; events want the token where
/// the policy says so; actions always, in a header that no other site's page can send, from no
/// other origin. On this machine the Host header must name it: a name that somebody else lets
/// point here does not (DNS rebinding).
[[nodiscard]] HttpDecision decide(const HttpRequest& request, const HttpPolicy& policy) noexcept;

/// Equal, in a time that tells nothing of where they differ.
[[nodiscard]] bool same_token(std::string_view a, std::string_view b) noexcept;

}  // namespace vergence::app
