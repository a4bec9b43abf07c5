/// Any bytes as a request to the live page. Entry point of libFuzzer; the unit tests call it with
/// seeded mutations.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "app/publish/http_request.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vergence::app;
  // Exactly so many bytes: a read behind the last one is found by ASan.
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  HttpRequest request;
  if (parse_http_request(bytes, &request) != HttpParse::complete) return 0;
  const HttpPolicy policy{"0123456789abcdef", true, "0.0.0.0"};
  const HttpDecision decision = decide(request, policy);
  const bool refused = decision.route == HttpRoute::refuse;
  if (refused != (decision.status >= 400)) std::abort();
  // Nobody gets at anything but the empty page without the token's very bytes.
  if (!refused && decision.route != HttpRoute::page && request.token != policy.token) std::abort();
  const bool action =
      !refused && decision.route != HttpRoute::page && decision.route != HttpRoute::events;
  if (action && (request.method != "POST" || !request.token_in_header)) std::abort();
  return 0;
}
