#include "app/publish/http_request.hpp"

#include <algorithm>
#include <array>

namespace vergence::app {
namespace {

constexpr std::size_t kMostHeaders = 64;

char lower(char c) noexcept { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same_name(std::string_view a, std::string_view b) noexcept {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

std::string_view trimmed(std::string_view s) noexcept {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t')) s.remove_suffix(1);
  return s;
}

bool printable(std::string_view s) noexcept {
  return std::all_of(s.begin(), s.end(), [](char c) { return c > 0x20 && c < 0x7f; });
}

/// Digits alone, at most nine of them.
bool read_length(std::string_view digits, std::uint64_t* out) noexcept {
  if (digits.empty() || digits.size() > 9) return false;
  *out = 0;
  for (const char c : digits) {
    if (c < '0' || c > '9') return false;
    *out = 10 * *out + static_cast<std::uint64_t>(c - '0');
  }
  return true;
}

/// `METHOD TARGET HTTP/1.x`
bool read_request_line(std::string_view line, HttpRequest* r) noexcept {
  const auto first = line.find(' '), last = line.rfind(' ');
  if (first == std::string_view::npos || first == last) return false;
  r->method = line.substr(0, first);
  std::string_view target = line.substr(first + 1, last - first - 1);
  const std::string_view version = line.substr(last + 1);
  if (version != "HTTP/1.1" && version != "HTTP/1.0") return false;
  if (r->method.empty() || target.empty() || target.front() != '/' || !printable(r->method) ||
      !printable(target))
    return false;
  const auto query = target.find('?');
  r->path = target.substr(0, query);
  if (query == std::string_view::npos) return true;
  constexpr std::string_view kToken = "token=";
  for (std::string_view rest = target.substr(query + 1); !rest.empty();) {
    const auto end = std::min(rest.find('&'), rest.size());
    if (const auto part = rest.substr(0, end); part.starts_with(kToken))
      r->token = part.substr(kToken.size());
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return true;
}

bool read_header(std::string_view line, HttpRequest* r) noexcept {
  const auto colon = line.find(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  const std::string_view name = line.substr(0, colon), value = trimmed(line.substr(colon + 1));
  if (!printable(name)) return false;
  if (same_name(name, "host")) r->host = value;
  if (same_name(name, "origin")) r->origin = value;
  if (same_name(name, "transfer-encoding")) r->chunked = true;
  if (same_name(name, "x-vergence-token")) {
    r->token = value;
    r->token_in_header = true;
  }
  return !same_name(name, "content-length") || read_length(value, &r->content_length);
}

/// The name in a Host header, without port and brackets.
std::string_view name_of(std::string_view host) noexcept {
  if (host.starts_with('[')) {
    const auto end = host.find(']');
    return end == std::string_view::npos ? host : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

bool names_this_machine(std::string_view host, const HttpPolicy& policy) noexcept {
  const std::string_view name = name_of(host);
  if (name == policy.host || name == "localhost" || name == "::1") return true;
  return name.starts_with("127.") &&
         name.find_first_not_of("0123456789.") == std::string_view::npos;
}

bool same_origin(const HttpRequest& r) noexcept {
  constexpr std::string_view kScheme = "http://";
  return r.origin.empty() ||
         (r.origin.starts_with(kScheme) && r.origin.substr(kScheme.size()) == r.host);
}

HttpDecision decide_action(HttpRoute route, const HttpRequest& r,
                           const HttpPolicy& policy) noexcept {
  if (!r.token_in_header || !same_token(r.token, policy.token))
    return {HttpRoute::refuse, 403, "the token is not that of this session"};
  if (!same_origin(r)) return {HttpRoute::refuse, 403, "asked for by another site"};
  if (r.content_length > 0 || r.chunked) return {HttpRoute::refuse, 413, "nothing is to be sent"};
  return {route, 204, ""};
}

}  // namespace

HttpParse parse_http_request(std::string_view bytes, HttpRequest* request) noexcept {
  const std::string_view window = bytes.substr(0, kMostRequestBytes);
  const auto end = window.find("\r\n\r\n");
  if (end == std::string_view::npos)
    return bytes.size() >= kMostRequestBytes ? HttpParse::too_large : HttpParse::incomplete;
  *request = {};
  std::string_view head = window.substr(0, end);
  for (std::size_t i = 0;; ++i) {
    const auto stop = std::min(head.find("\r\n"), head.size());
    const std::string_view line = head.substr(0, stop);
    if (i > kMostHeaders) return HttpParse::malformed;
    if (!(i == 0 ? read_request_line(line, request) : read_header(line, request)))
      return HttpParse::malformed;
    if (stop == head.size()) return HttpParse::complete;
    head.remove_prefix(stop + 2);
  }
}

bool same_token(std::string_view a, std::string_view b) noexcept {
  if (a.size() != b.size() || b.empty()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference |=
        static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]));
  return difference == 0;
}

HttpDecision decide(const HttpRequest& r, const HttpPolicy& policy) noexcept {
  struct Action {
    std::string_view path;
    HttpRoute route;
  };
  constexpr std::array kActions{Action{"/recalibrate", HttpRoute::recalibrate},
                                Action{"/mark", HttpRoute::mark},
                                Action{"/stop-recording", HttpRoute::stop_recording}};
  if (!policy.token_to_read && !names_this_machine(r.host, policy))
    return {HttpRoute::refuse, 421, "this page is for this machine: open it by its address"};
  if (r.method == "POST") {
    for (const Action& action : kActions)
      if (r.path == action.path) return decide_action(action.route, r, policy);
    return {HttpRoute::refuse, 404, "there is no such action"};
  }
  if (r.method != "GET") return {HttpRoute::refuse, 405, "only GET and POST are understood"};
  if (r.path == "/") return {HttpRoute::page, 200, ""};
  if (r.path != "/events") return {HttpRoute::refuse, 404, "there is no such page"};
  if (policy.token_to_read && !same_token(r.token, policy.token))
    return {HttpRoute::refuse, 403, "the token is not that of this session"};
  return {HttpRoute::events, 200, ""};
}

}  // namespace vergence::app
